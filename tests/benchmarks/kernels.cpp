// Tracing and building against Embree in its best modes, by kind of ray, on one thread and two.
//
// tests/bench kernels [--help]
#include <cstdio>
#include <exception>

#include <CLI/CLI.hpp>

#include "core/accel/accel_table.h"
#include "core/plan/plan.h"
#include "tests/benchmarks/support/kernel_race.h"
#include "tests/benchmarks/support/report.h"

namespace tessera::bench {
namespace {

struct Options {
  std::string folder, accel = "auto";
  std::vector<std::string> scenes{kKernelScenes.begin(), kKernelScenes.end()};
  std::vector<std::string> rays{kKernelRays.begin(), kKernelRays.end()};
  std::uint32_t width = 1024;
  RaceOptions race;
};

AccelOptions accel_options(const KernelScene& scene, const Options& options) {
  Settings settings;
  settings.width = settings.height = options.width;
  for (const AccelEntry& row : accel_table())
    if (row.name == options.accel) settings.accel.kind = row.kind;
  return make_plan(*scene.scene, scene.camera, settings).accel;
}

double bound_of(const std::string& rays) { return rays == "first_level" ? 1.5 : 1; }

void print(const std::vector<Race>& races, const std::vector<int>& threads) {
  std::vector<std::vector<std::string>> rows = {
      {"rays", "million", "threads", "ours", "Embree", "ours / Embree", "its mode", "≠ default", "≠ robust"}};
  const auto differing = [](const Disagreement& d) {
    return std::to_string(d.hit_or_miss) + " + " + std::to_string(d.t);
  };
  for (const Race& race : races)
    for (const int n : threads) {
      const auto t = static_cast<std::size_t>(n - 1);
      const Race::Peer* best = race.best(n);
      rows.push_back({race.rays, fixed(1e-6 * static_cast<double>(race.count), 2), std::to_string(n),
                      with_spread(race.mrays[t]), best ? with_spread(best->mrays[t]) : "-",
                      best ? with_spread(best->our_ratio[t]) : "-", best ? name(best->mode) : "-",
                      differing(race.from_default), differing(race.from_robust)});
    }
  print_table(rows);
}

void measure(Report& report, const Options& options) {
  std::printf("%s\n", embree_version().c_str());
  for (const std::string& scene_name : options.scenes) {
    const KernelScene scene = kernel_scene(scene_name);
    const AccelOptions accel_options_ = accel_options(scene, options);
    const auto accel = make_accel(scene.scene, accel_options_);
    std::printf("\n%s: %zu triangles; %s\n", scene.name.c_str(), scene.triangles(), describe(accel_options_).c_str());
    const Peers peers = build_peers(scene.mesh());
    std::vector<Race> races;
    for (const RaySet& set : kernel_rays(scene, *accel, options.width))
      if (std::ranges::find(options.rays, set.name) != options.rays.end())
        races.push_back(race(*accel, peers, set, options.race));
    print(races, options.race.threads);
    for (const Race& race : races)
      for (const int n : options.race.threads)
        if (const Race::Peer* best = race.best(n))
          report.at_least(race.rays + "_" + scene.name + (n == 2 ? "_2t" : ""),
                          best->our_ratio[static_cast<std::size_t>(n - 1)].median(), bound_of(race.rays));
  }
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  tessera::bench::Options options;
  CLI::App app("Tracing and building against Embree");
  app.add_option("folder", options.folder, "Where JSON and plots go")->required();
  app.add_option("--accel", options.accel, "Our structure");
  app.add_option("--scenes", options.scenes, "Only these")->delimiter(',');
  app.add_option("--rays", options.rays, "Only these")->delimiter(',');
  app.add_option("--width", options.width, "Pixels along each side of the picture");
  app.add_option("--repetitions", options.race.repetitions, "Medians are of so many");
  CLI11_PARSE(app, argc, argv);
  try {
    tessera::bench::Report report("kernels", options.folder);
    tessera::bench::measure(report, options);
    report.finish();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_kernels: %s\n", error.what());
    return 1;
  }
}
