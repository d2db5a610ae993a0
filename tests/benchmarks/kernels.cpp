// Tracing and building against Embree in its best modes, by kind of ray, on one thread and two.
//
// tests/bench kernels [--scenes A,B] [--rays A,B] [--threads 1|2|both] [--width N] [--repetitions N] [--accel KIND]
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "core/accel/accel_table.h"
#include "core/plan/plan.h"
#include "tests/benchmarks/support/kernel_tables.h"

namespace tessera::bench {
namespace {

struct Options {
  std::string folder, accel = "auto", threads = "both";
  std::vector<std::string> scenes{kKernelScenes.begin(), kKernelScenes.end()};
  /// Kinds of rays; and what else is measured: "build", "leaks".
  std::vector<std::string> rays{kKernelRays.begin(), kKernelRays.end()};
  std::uint32_t width = 1024;
  int repetitions = 5;

  bool wants(const std::string& what) const { return std::ranges::find(rays, what) != rays.end(); }
  RaceOptions race() const {
    if (threads == "both") return {repetitions, {1, 2}};
    return {repetitions, {threads == "1" ? 1 : 2}};
  }
};

/// What a job with such a picture would be traced with.
AccelOptions accel_options(const KernelScene& scene, const Options& options) {
  Settings settings;
  settings.width = settings.height = options.width;
  for (const AccelEntry& row : accel_table())
    if (row.name == options.accel) settings.accel.kind = row.kind;
  return make_plan(*scene.scene, scene.camera, settings).accel;
}

SceneFigures measure(const KernelScene& scene, const Options& options) {
  const AccelOptions accel = accel_options(scene, options);
  SceneFigures figures{scene.name, scene.triangles(), describe(accel), {}, {}};
  if (options.wants("build")) figures.builds = race_builds(scene, accel, options.race());
  const bool wants_rays =
      std::ranges::any_of(kKernelRays, [&](std::string_view r) { return options.wants(std::string(r)); });
  if (!wants_rays) return figures;
  const auto ours = make_accel(scene.scene, accel);
  const Peers peers = build_peers(scene.mesh());
  for (const RaySet& set : kernel_rays(scene, *ours, options.width))
    if (options.wants(set.name)) figures.races.push_back(race(*ours, peers, set, options.race()));
  return figures;
}

void print_header(const Options& options) {
  std::printf(
      "\nTessera against %s: medians of %d repetitions in turns, ± half the distance between the quartiles.\n"
      "First-level rays are handed over by tiles of %u × %u pixels, shadow rays by what such tiles hit, all others by\n"
      "%zu. Packets for Embree are ready before its clock starts. Tracing: processor time, on two threads of the one\n"
      "that took more. Building: processor time, on two threads seconds on the clock. ≠: rays for which Embree, one "
      "ray\n"
      "a call, disagrees with us on hit or miss + by more than 10⁻⁴ of t.\n",
      embree_version().c_str(), options.repetitions, kTileSide, kTileSide, kBatch);
}

void measure_all(Report& to, const Options& options) {
  print_header(options);
  std::vector<SceneFigures> all;
  for (const std::string& name : options.scenes) {
    all.push_back(measure(kernel_scene(name), options));
    print(all.back(), options.race().threads);
    report(all.back(), options.race().threads, to);
  }
  if (options.wants("leaks")) {
    const auto leaks = count_leaks(accel_options(kernel_scene("organic_100k"), options));
    print(leaks);
    report(leaks, to);
  }
  to.write_plot(speed_chart(all));
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera;
  bench::Options options;
  for (const char* more : {"build", "leaks"}) options.rays.emplace_back(more);
  std::vector<std::string> kinds = {"auto"};
  for (const AccelEntry& row : accel_table()) kinds.emplace_back(row.name);

  CLI::App app("Measures tracing and building against Embree.", "tests/bench kernels");
  app.add_option("folder", options.folder, "where JSON and plot go; tests/bench gives it")->required();
  app.add_option("--scenes", options.scenes, "only these")->delimiter(',')->check(CLI::IsMember(options.scenes));
  app.add_option("--rays", options.rays, "only these")->delimiter(',')->check(CLI::IsMember(options.rays));
  app.add_option("--threads", options.threads)->check(CLI::IsMember({"1", "2", "both"}));
  app.add_option("--width", options.width, "of the square picture, a multiple of 32")
      ->check([](const std::string& width) { return std::stoi(width) % 32 == 0 ? "" : "not a multiple of 32"; });
  app.add_option("--repetitions", options.repetitions)->check(CLI::PositiveNumber);
  app.add_option("--accel", options.accel, "our structure")->check(CLI::IsMember(kinds));
  CLI11_PARSE(app, argc, argv);
  try {
    bench::Report report("kernels", options.folder);
    bench::measure_all(report, options);
    report.finish();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_kernels: %s\n", error.what());
    return 1;
  }
}
