// What the renderer does today: build times, rays a second by kind, skipped work, two threads against one, a job's
// cost.
#include <cstdio>
#include <exception>

#include "core/accel/accel_table.h"
#include "tests/benchmarks/support/bar_chart.h"
#include "tests/benchmarks/support/bench_scenes.h"
#include "tests/benchmarks/support/job_overhead.h"
#include "tests/benchmarks/support/recorded_rays.h"
#include "tests/benchmarks/support/render_image.h"
#include "tests/benchmarks/support/report.h"

namespace tessera::bench {
namespace {

constexpr int kRepetitions = 5;

/// One scene, prepared once and measured again and again.
class SceneBench {
 public:
  explicit SceneBench(BenchScene scene)
      : scene_(std::move(scene)), context_(prepare(scene_.scene, scene_.camera, settings())) {
    rays_ = record_rays(context_);
  }

  void repeat() {
    const Stopwatch watch;
    const auto accel = make_accel(scene_.scene, context_.plan.accel);
    build_ms_.add(1e3 * watch.seconds());
    for (const RayKind kind : kRayKinds)
      if (!rays_.of(kind).empty()) speed(kind).add(trace_speed(*accel, kind, rays_.of(kind)));
    const RenderTime one = render(context_, 1), two = render(context_, 2);
    counts_ = one.rays;
    render_ms_.add(1e3 * one.seconds);
    two_threads_.add(one.seconds / two.seconds);
  }

  static std::vector<std::string> header() {
    return {"scene",      "primitives",  "structure",   "build ms",      "camera",       "shadow",      "reflection",
            "refraction", "1 thread ms", "2 threads ×", "tiles skipped", "rays skipped", "never tested"};
  }
  std::vector<std::string> row() const {
    return {scene_.name,
            std::to_string(context_.plan.primitives),
            std::string(accel_name(context_.plan.accel.kind)),
            with_spread(build_ms_, 2),
            with_spread(speed(RayKind::camera), 2),
            with_spread(speed(RayKind::shadow), 2),
            with_spread(speed(RayKind::reflection), 2),
            with_spread(speed(RayKind::refraction), 2),
            with_spread(render_ms_, 0),
            with_spread(two_threads_, 2),
            fixed(100 * tiles_skipped(), 0) + "%",
            fixed(100 * camera_skipped(), 0) + "%",
            std::to_string(never_tested())};
  }

  void report(Report& to) const {
    auto& json = to.figures()["scenes"][scene_.name];
    const AccelStats stats = context_.accel->stats();
    json = {{"primitives", context_.plan.primitives},
            {"objects", scene_.scene->objects.size()},
            {"structure", accel_name(context_.plan.accel.kind)},
            {"structure_bytes", stats.bytes},
            {"build_ms", build_ms_.to_json()},
            {"one_thread_ms", render_ms_.to_json()},
            {"two_thread_speed", two_threads_.to_json()},
            {"tiles", context_.plan.tiling.tiles.size()},
            {"tiles_skipped_share", tiles_skipped()},
            {"camera_rays_skipped_share", camera_skipped()},
            {"objects_never_tested_by_camera_rays", never_tested()}};
    for (const RayKind kind : kRayKinds)
      json["mrays"][name(kind)] = {{"rays", rays_.of(kind).size()}, {"speed", speed(kind).to_json()}};
    if (scene_.from_issue) to.at_least("two_thread_speed/" + scene_.name, two_threads_.median(), 1.85);
  }

  BarGroup bars() const {
    BarGroup group{scene_.name, {}};
    for (const RayKind kind : kRayKinds) group.bars.push_back(speed(kind));
    return group;
  }

 private:
  static Settings settings() {
    Settings s;
    s.width = s.height = 513;  // Haines' size
    return s;
  }
  Samples& speed(RayKind kind) { return speeds_[static_cast<std::size_t>(kind)]; }
  const Samples& speed(RayKind kind) const { return speeds_[static_cast<std::size_t>(kind)]; }

  double tiles_skipped() const {
    const auto& tiles = context_.plan.tiling.tiles;
    const auto skipped = std::ranges::count(tiles, FirstLevel::nothing, &Tile::first_level);
    return static_cast<double>(skipped) / static_cast<double>(tiles.size());
  }
  double camera_skipped() const {
    return static_cast<double>(counts_.camera_skipped) / static_cast<double>(counts_.camera + counts_.camera_skipped);
  }
  std::uint64_t never_tested() const { return scene_.scene->objects.size() - context_.plan.tiling.objects_on_screen; }

  BenchScene scene_;
  RenderContext context_;
  RecordedRays rays_;
  RayCounts counts_;
  std::array<Samples, kRayKinds.size()> speeds_;
  Samples build_ms_, render_ms_, two_threads_;
};

void measure_scenes(Report& report) {
  std::vector<SceneBench> scenes;
  for (BenchScene& scene : bench_scenes()) scenes.emplace_back(std::move(scene));
  // Interleaved: whatever else the machine does meets every scene alike.
  for (int i = 0; i < kRepetitions; ++i)
    for (SceneBench& scene : scenes) scene.repeat();

  std::printf(
      "\n513 x 513 pixels, depth 5. Camera to refraction: Mray/s on one thread, each kind of a render's rays traced\n"
      "by itself. Medians of %d interleaved repetitions, ± half the distance between the quartiles.\n",
      kRepetitions);
  std::vector<std::vector<std::string>> rows = {SceneBench::header()};
  std::vector<BarGroup> groups;
  for (const SceneBench& scene : scenes) {
    rows.push_back(scene.row());
    groups.push_back(scene.bars());
    scene.report(report);
  }
  print_table(rows);
  std::vector<std::string> kinds;
  for (const RayKind kind : kRayKinds) kinds.emplace_back(name(kind));
  report.write_plot(bar_chart("Tracing by kind of ray, one thread", "Mray/s", kinds, groups));
}

void measure_job(Report& report) {
  const JobOverhead job = measure_job_overhead(TESSERAD);
  print_table({{"a 64 x 64 job over HTTP", "ms"},
               {"tracing alone", with_spread(job.tracing, 2)},
               {"overhead until completed", with_spread(job.completed, 2)},
               {"overhead until the PNG is fetched", with_spread(job.fetched, 2)}});
  report.figures()["job_64x64_ms"] = {{"tracing", job.tracing.to_json()},
                                      {"overhead_completed", job.completed.to_json()},
                                      {"overhead_fetched", job.fetched.to_json()}};
  report.at_most("job_overhead_ms", job.fetched.median(), 5);
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: bench_baseline FOLDER\n");
    return 2;
  }
  try {
    tessera::bench::Report report("baseline", argv[1]);
    tessera::bench::measure_scenes(report);
    tessera::bench::measure_job(report);
    report.finish();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_baseline: %s\n", error.what());
    return 1;
  }
}
