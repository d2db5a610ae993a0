// Every structure × bound over every scene: build, memory, speed by kind of ray, tests; and how they grow.
//
// tests/bench structures [PART]: with PART only the scenes whose name contains it; or "growth", which is that alone.
#include <algorithm>
#include <cstdio>
#include <exception>

#include "tests/benchmarks/support/growth.h"
#include "tests/benchmarks/support/panels.h"
#include "tests/benchmarks/support/render_image.h"
#include "tests/benchmarks/support/report.h"
#include "tests/benchmarks/support/structure_bench.h"
#include "tests/benchmarks/support/svg.h"

namespace tessera::bench {
namespace {

constexpr int kRepetitions = 3;
constexpr std::size_t kRaysOfAKind = 1 << 15;

/// All structures over one scene.
class SceneBench {
 public:
  explicit SceneBench(const BenchScene& scene) : scene_(scene) {
    const RenderContext context = prepare(scene.scene, scene.camera, settings(AccelKind::automatic));
    plan_ = context.plan;
    rays_ = sample_rays(record_rays(context), kRaysOfAKind);
    rays_.push_back(random_segments(*scene.scene, kRaysOfAKind, 1));
    for (const StructureChoice& choice : structure_choices()) benches_.emplace_back(choice, scene.scene, rays_);
    // What the plan picks may have options that no fixed choice has.
    if (std::ranges::none_of(benches_, [&](const StructureBench& b) { return is_automatic(b); }))
      benches_.emplace_back(StructureChoice{"auto " + std::string(accel_name(plan_.accel.kind)), plan_.accel},
                            scene.scene, rays_);
  }

  SceneBench(const SceneBench&) = delete;  // the benches refer to its rays

  void measure() {
    // Interleaved: whatever else the machine does meets every structure alike.
    for (int i = 0; i < kRepetitions; ++i) {
      for (StructureBench& bench : benches_) bench.repeat();
      planning_ms_.add(1e3 * (planning_seconds(AccelKind::automatic) - planning_seconds(AccelKind::bvh)));
    }
    for (StructureBench& bench : benches_) bench.count();
    std::ranges::sort(benches_, {}, [](const StructureBench& b) { return b.total_ms().median(); });
  }

  void print() const {
    double rays = 0;
    for (const RaySample& sample : rays_) rays += sample.rays_in_a_job;
    std::printf("\n%s: %llu primitives, %zu objects; a 513 × 513 job's %.0f rays\n", scene_.name.c_str(),
                static_cast<unsigned long long>(plan_.primitives), scene_.scene->objects.size(), rays);
    std::vector<std::vector<std::string>> rows = {{"structure", "total ms", "build ms", "bytes", "first-level",
                                                   "shadow", "random", "volumes/ray", "objects/ray", "false hits",
                                                   "predicted ms"}};
    for (const StructureBench& b : benches_) {
      const AccelEstimate* estimate = estimate_of(b);
      rows.push_back({(is_automatic(b) ? "> " : "  ") + b.choice().label, with_spread(b.total_ms()),
                      with_spread(b.build_ms()), short_bytes(static_cast<double>(b.stats().bytes)), speed(b, "camera"),
                      speed(b, "shadow"), speed(b, "random"), fixed(b.tests().volume_tests, 1),
                      fixed(b.tests().object_tests, 2), fixed(100 * b.tests().false_hit_rate(), 0) + "%",
                      estimate ? three_digits(1e3 * (estimate->build_seconds + estimate->trace_seconds)) : "-"});
    }
    print_table(rows);
    std::printf("> auto, %s: %.3f of the best, %.3f with the %.2f ms that its planning took beyond a fixed choice's\n",
                plan_.accel_because.c_str(), automatic_ratio(0), automatic_ratio(planning_ms()), planning_ms());
    std::fflush(stdout);
  }

  void report(Report& to) const {
    auto& json = to.figures()["scenes"][scene_.name];
    json = {{"primitives", plan_.primitives}, {"objects", scene_.scene->objects.size()}};
    for (const RaySample& sample : rays_) json["rays_in_a_job"][sample.name] = sample.rays_in_a_job;
    json["automatic"] = {{"options", describe(plan_.accel)},
                         {"because", plan_.accel_because},
                         {"extra_planning_ms", planning_ms_.to_json()},
                         {"total_over_best", automatic_ratio(planning_ms())},
                         {"total_over_best_without_planning", automatic_ratio(0)}};
    for (const StructureBench& b : benches_) {
      auto& row = json["structures"].emplace_back(b.to_json());
      row["is_automatic"] = is_automatic(b);
      if (const AccelEstimate* estimate = estimate_of(b))
        row["predicted_ms"] = {{"build", 1e3 * estimate->build_seconds}, {"trace", 1e3 * estimate->trace_seconds}};
    }
    to.at_most("auto_total/" + scene_.name, automatic_ratio(planning_ms()), 1.10);
  }

  Panel panel() const {
    Panel panel{
        scene_.name,
        std::to_string(plan_.primitives) + " primitives, " + std::to_string(scene_.scene->objects.size()) + " objects",
        {}};
    for (const StructureBench& b : benches_)
      panel.bars.push_back({b.choice().label, color_of(b.choice().options.kind), 1e-3 * b.total_ms().median(),
                            1e-3 * b.build_ms().median(), is_automatic(b)});
    return panel;
  }

 private:
  static Settings settings(AccelKind kind) {
    Settings s;
    s.width = s.height = 513;  // Haines' size
    s.accel.kind = kind;
    return s;
  }
  double planning_seconds(AccelKind kind) const {
    const CpuStopwatch watch;
    make_plan(*scene_.scene, scene_.camera, settings(kind));
    return watch.seconds();
  }
  bool is_automatic(const StructureBench& b) const { return describe(b.choice().options) == describe(plan_.accel); }

  const AccelEstimate* estimate_of(const StructureBench& b) const {
    const auto at = std::ranges::find(plan_.candidates, describe(b.choice().options),
                                      [](const AccelEstimate& e) { return describe(e.options); });
    return at == plan_.candidates.end() ? nullptr : &*at;
  }

  /// What planning takes when the plan has to pick, beyond what it takes when it is told.
  double planning_ms() const { return std::max(0.0, planning_ms_.median()); }

  /// The job's time with what the plan picks, and something more, over that with the best choice.
  double automatic_ratio(double more_ms) const {
    const auto automatic = std::ranges::find_if(benches_, [&](const StructureBench& b) { return is_automatic(b); });
    return (automatic->total_ms().median() + more_ms) / benches_.front().total_ms().median();
  }

  static std::string speed(const StructureBench& b, const std::string& rays) {
    const Samples* mrays = b.mrays(rays);
    return mrays ? with_spread(*mrays) : "-";
  }

  BenchScene scene_;
  Plan plan_;
  std::vector<RaySample> rays_;
  std::vector<StructureBench> benches_;
  Samples planning_ms_;
};

void measure_scenes(Report& report, const std::string& part) {
  std::printf(
      "\nOne thread, processor time. Medians of %d interleaved repetitions, ± half the distance between the "
      "quartiles.\n"
      "Total: build, and a 513 × 513 Whitted job's rays at the speeds of a sample of each kind. First-level, shadow,\n"
      "random: Mray/s. Volumes, objects: tests per ray of the job. False hits: leaves and groups looked into in vain,\n"
      "as a share of the volumes hit. > is what auto takes; predicted: by the plan.\n",
      kRepetitions);
  std::vector<Panel> panels;
  for (const BenchScene& scene : bench_scenes(part)) {
    SceneBench bench(scene);
    bench.measure();
    bench.print();
    bench.report(report);
    panels.push_back(bench.panel());
  }
  std::vector<LegendEntry> legend;
  for (const AccelEntry& row : accel_table()) legend.push_back({std::string(row.name), color_of(row.kind)});
  report.write_plot(panel_chart("One job under every structure",
                                "Build and trace a 513 × 513 Whitted job on one thread, best first. Logarithmic; the "
                                "dark mark is where building ends, ▸ is what auto takes.",
                                legend, panels));
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "usage: bench_structures FOLDER [PART_OF_A_SCENE'S_NAME | growth]\n");
    return 2;
  }
  try {
    tessera::bench::Report report("structures", argv[1]);
    const std::string part = argc == 3 ? argv[2] : "";
    if (part != "growth") tessera::bench::measure_scenes(report, part);
    if (part.empty() || part == "growth") tessera::bench::measure_growth(report);
    report.finish();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_structures: %s\n", error.what());
    return 1;
  }
}
