// How often the interval that jobs state for their error holds the true one, over jobs that stop at an asked-for error.
//
// tests/bench intervals [--quick] [--threads N]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "tests/benchmarks/support/error_curve.h"
#include "tests/benchmarks/support/light_renderers.h"
#include "tests/benchmarks/support/report.h"
#include "tests/benchmarks/support/work_folder.h"

namespace tessera::bench {
namespace {

constexpr double kTargets[] = {0.1, 0.05, 0.025};
constexpr int kMostSamples = 16384;  ///< Enough for every target.
constexpr double kHeldBar = 0.93;    ///< Of intervals that hold the error in 95 of 100 cases.

struct Options {
  std::string folder;
  bool is_quick = false;
  unsigned threads = 2;

  int seeds() const { return is_quick ? 7 : 20; }
  std::uint32_t reference_samples() const { return is_quick ? 1024 : 8192; }
};

/// What came of the jobs with one target over one scene.
struct Tally {
  int jobs = 0, held = 0, above = 0, stopped_late = 0;
  double error = 0, samples = 0;  ///< Sums of true errors, and of mean samples a pixel.

  Tally& operator+=(const Tally& other) {
    jobs += other.jobs, held += other.held, above += other.above, stopped_late += other.stopped_late;
    return *this;
  }
  double share() const { return static_cast<double>(held) / jobs; }
};

Tally run_jobs(Tessera& tessera, const LightScene& scene, const LongReference& reference, double target,
               const Options& options) {
  Tally tally;
  for (int seed = 0; seed < options.seeds(); ++seed) {
    proto::JobStatus status;
    const Rendered r = tessera.render(
        scene, {{"until", {{"error", target}, {"samples", kMostSamples}}}, {"seed", seed}}, nullptr, &status);
    if (!status.achieved) throw std::runtime_error(scene.name + ": the job doesn't say what its error is");
    const double error = std::sqrt(std::max(0.0, reference.error(r.image)));
    ++tally.jobs;
    tally.held += error >= status.achieved->interval.low && error <= status.achieved->interval.high;
    tally.above += error > status.achieved->interval.high;
    tally.stopped_late += status.ended_by != "error";
    tally.error += error;
    tally.samples += status.samples_per_pixel.mean;
  }
  return tally;
}

Tally measure(Report& report, Tessera& tessera, const LightScene& scene, const Options& options) {
  const auto half = [&](int seed) {
    return tessera.render(scene, {{"samples", options.reference_samples()}, {"seed", seed}}).image;
  };
  const LongReference reference(half(1001), half(1002));
  std::vector<std::vector<std::string>> rows = {
      {scene.name, "jobs", "interval holds", "error above it", "not by error", "mean error", "mean samples"}};
  Tally all;
  for (const double target : kTargets) {
    const Tally tally = run_jobs(tessera, scene, reference, target, options);
    rows.push_back({"error " + fixed(target, 3), std::to_string(tally.jobs), fixed(100 * tally.share(), 0) + "%",
                    std::to_string(tally.above), std::to_string(tally.stopped_late),
                    three_digits(tally.error / tally.jobs), fixed(tally.samples / tally.jobs, 0)});
    report.figures()["scenes"][scene.name].push_back({{"target", target},
                                                      {"jobs", tally.jobs},
                                                      {"held", tally.held},
                                                      {"above", tally.above},
                                                      {"not_by_error", tally.stopped_late},
                                                      {"mean_error", tally.error / tally.jobs},
                                                      {"mean_samples", tally.samples / tally.jobs}});
    all += tally;
  }
  print_table(rows);
  return all;
}

void measure_all(Report& report, const Options& options) {
  const WorkFolder folder("intervals");
  Tessera tessera(TESSERAD, folder.path(), options.threads);
  Tally all;
  for (const LightScene& scene : light_scenes(folder.path())) {
    // Where hardly anything is random, so is the error.
    if (scene.name.ends_with("-d1") || scene.name == "point") continue;
    if (options.is_quick && (scene.name == "kitchen" || scene.name == "lamps-2400")) continue;
    all += measure(report, tessera, scene, options);
  }
  report.at_least("intervals/held", all.share(), kHeldBar);
  report.at_least("intervals/jobs", all.jobs, 100);
  // Light that seldom is found: what isn't seen can't be told. Reported, by itself, without a bar.
  const Tally caustic = measure(report, tessera, caustic_scene(), options);
  std::printf("caustic: the interval holds the error in %.0f%% of %d jobs\n", 100 * caustic.share(), caustic.jobs);
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera;
  bench::Options options;
  CLI::App app("Measures how often stated intervals hold the true error.", "tests/bench intervals");
  app.add_option("folder", options.folder, "where the JSON goes; tests/bench gives it")->required();
  app.add_flag("--quick", options.is_quick, "fewer jobs and shorter references");
  app.add_option("--threads", options.threads)->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  try {
    bench::Report report("intervals", options.folder);
    bench::measure_all(report, options);
    report.finish();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_intervals: %s\n", error.what());
    return 1;
  }
}
