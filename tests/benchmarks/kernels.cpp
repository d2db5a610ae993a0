// Tracing and building against Embree in its best modes, by kind of ray, on one thread and two.
//
// tests/bench kernels [--scenes A,B] [--rays A,B] [--threads 1|2|both] [--width N] [--repetitions N] [--accel KIND]
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <string_view>
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

  bool wants(std::string_view what) const { return std::ranges::find(rays, what) != rays.end(); }
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
  if (std::ranges::none_of(kKernelRays, [&](std::string_view kind) { return options.wants(kind); })) return figures;
  const auto ours = make_accel(scene.scene, accel);
  const Peers peers = build_peers(scene.mesh());
  for (const RaySet& set : kernel_rays(scene, *ours, options.width))
    if (options.wants(set.name)) figures.races.push_back(race(*ours, peers, set, options.race()));
  return figures;
}

void print_header(const Options& options) {
  if (embree_version().empty())
    std::printf("\nEmbree is missing (deploy/install-deps --bench brings it): Tessera is measured alone.\n");
  else
    std::printf("\nTessera against %s in its best modes.\n", embree_version().c_str());
  std::printf(
      "Medians of %d repetitions in turns, ± half the distance between the quartiles. Tracing: processor time, on two\n"
      "threads of the one that took more. First-level rays are handed over by tiles of %u × %u pixels, shadow rays by\n"
      "what a tile hit, random rays by %zu, all others by %zu; Embree's packets are ready before its clock starts.\n"
      "≠: rays for which Embree, asked one by one, disagrees with us on hit or miss + by more than 10⁻⁴ of t.\n"
      "Building: processor time, on two threads seconds on the clock.\n",
      options.repetitions, kTileSide, kTileSide, kRandomBatch, kBatch);
}

void measure_all(Report& to, const Options& options) {
  print_header(options);
  const std::vector<int> threads = options.race().threads;
  for (const std::string& name : options.scenes) {
    const SceneFigures figures = measure(kernel_scene(name), options);
    print(figures, threads);
    report(figures, threads, to);
    if (!figures.races.empty()) to.write_plot(speed_chart(figures, threads), figures.scene);
  }
  if (options.wants("leaks")) {
    const auto leaks = count_leaks(accel_options(kernel_scene("organic_100k"), options));
    print(leaks);
    report(leaks, to);
  }
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
  app.add_option("--width", options.width, "of the square picture")->check(CLI::IsMember({128, 256, 512, 1024, 2048}));
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
