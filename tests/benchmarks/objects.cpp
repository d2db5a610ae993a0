// Many objects: the same triangles as thousands of meshes against one mesh, and up to a million instances against
// Embree's.
//
// tests/bench objects [--quick] [--only PART] [--width N] [--repetitions N] [--largest OBJECTS]
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <malloc.h>

#include "core/accel/accel_table.h"
#include "core/plan/plan.h"
#include "tests/benchmarks/support/bar_chart.h"
#include "tests/benchmarks/support/kernel_tables.h"
#include "tests/benchmarks/support/many_objects.h"
#include "tests/benchmarks/support/our_rays.h"
#include "tests/benchmarks/support/render_image.h"

namespace tessera::bench {
namespace {

constexpr double kMostRatio = 1.1, kMostBytes = 128;

struct Options {
  std::string folder, only;  ///< Only scenes whose names contain that.
  bool is_quick = false;
  std::uint32_t width = 512, largest = 1'000'000;
  int repetitions = 5;

  bool wants(const std::string& name, std::uint32_t objects) const {
    return objects <= largest && name.find(only) != std::string::npos;
  }
};

Settings settings_of(const Options& options) {
  Settings settings;
  settings.width = settings.height = options.width;
  settings.samples = 4;
  return settings;
}

/// Heap that the process holds.
std::size_t heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

/// One of the ways in which the triangles are a scene: a render of it, from its plan on, and rays of each kind.
class Way {
 public:
  Way(std::string name, std::shared_ptr<const Scene> scene, const Camera& camera)
      : name_(std::move(name)), scene_(std::move(scene)), camera_(camera) {}

  const std::string& name() const { return name_; }

  void render(const Settings& settings) {
    context_.reset();
    const CpuStopwatch watch;
    context_.emplace(bench::prepare(scene_, camera_, settings));
    prepare_.add(watch.seconds());
    bench::render(*context_, 1);
    whole_.add(watch.seconds());
  }

  /// Takes rays that are made for the one mesh.
  void use(std::vector<RaySet> rays, std::uint32_t triangles_each) {
    rays_ = std::move(rays);
    if (triangles_each != 0)
      for (RaySet& set : rays_)
        for (Ray& ray : set.rays)
          if (ray.leaves.object == 0)
            ray.leaves = {ray.leaves.primitive / triangles_each, ray.leaves.primitive % triangles_each};
    seconds_.resize(rays_.size());
  }
  void trace() {
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      OurRays rays(*context_->accel, rays_[i]);
      seconds_[i].add(1e-6 * static_cast<double>(rays_[i].rays.size()) / rays.mrays(1));
    }
  }

  const Samples& whole() const { return whole_; }
  const Samples& prepare_seconds() const { return prepare_; }
  const std::vector<RaySet>& rays() const { return rays_; }
  const Samples& seconds(std::size_t set) const { return seconds_[set]; }
  const Accel& accel() const { return *context_->accel; }

 private:
  std::string name_;
  std::shared_ptr<const Scene> scene_;
  Camera camera_;
  std::optional<RenderContext> context_;
  Samples prepare_, whole_;
  std::vector<RaySet> rays_;
  std::vector<Samples> seconds_;  ///< As `rays_`.
};

void measure_objects(Report& to, const Options& options, Crowd crowd, std::uint32_t objects, std::uint32_t each) {
  ManyObjects scenes = many_objects(crowd, objects, each);
  const std::string label = scenes.one.name;
  std::vector<Way> ways;
  ways.emplace_back("one", scenes.one.scene, scenes.one.camera);
  ways.emplace_back("separate", scenes.separate, scenes.one.camera);
  ways.emplace_back("placed", scenes.placed, scenes.one.camera);
  const Settings settings = settings_of(options);
  const bool is_large = std::uint64_t{objects} * each > 5'000'000;
  const int repetitions = is_large ? std::min(options.repetitions, 3) : options.repetitions;
  std::vector<std::vector<Samples>> ratios(ways.size());
  for (int i = 0; i < repetitions; ++i) {
    for (Way& way : ways) way.render(settings);
    if (i == 0) {
      const std::vector<RaySet> rays = kernel_rays(scenes.one, ways[0].accel(), options.width);
      for (Way& way : ways) way.use(rays, &way == &ways[0] ? 0 : each);
      for (std::size_t w = 0; w < ways.size(); ++w) ratios[w].resize(rays.size() + 1);
      for (Way& way : ways) way.trace();  // all that is made lazily is made then
    }
    for (Way& way : ways) way.trace();
    for (std::size_t w = 1; w < ways.size(); ++w) {
      ratios[w][0].add(ways[w].whole().last() / ways[0].whole().last());
      for (std::size_t set = 0; set < ways[0].rays().size(); ++set)
        ratios[w][set + 1].add(ways[w].seconds(set).last() / ways[0].seconds(set).last());
    }
  }
  std::vector<std::string> header = {label, "prepare ms", "whole ms", "whole ×"};
  for (const RaySet& set : ways[0].rays()) header.push_back(set.name + " ×");
  std::vector<std::vector<std::string>> rows = {header};
  for (std::size_t w = 0; w < ways.size(); ++w) {
    const Way& way = ways[w];
    rows.push_back({way.name(), fixed(1e3 * way.prepare_seconds().median(), 0), fixed(1e3 * way.whole().median(), 0)});
    for (const Samples& ratio : ratios[w]) rows.back().push_back(ratio.empty() ? "" : with_spread(ratio, 2));
    auto& json = to.figures()["objects"][label][way.name()];
    json = {{"prepare_seconds", way.prepare_seconds().to_json()}, {"whole_seconds", way.whole().to_json()}};
    if (w == 0) continue;
    json["whole_ratio"] = ratios[w][0].to_json();
    to.at_most("whole/" + label + "/" + way.name(), ratios[w][0].median(), kMostRatio);
    for (std::size_t set = 0; set < way.rays().size(); ++set) {
      json["ratio"][way.rays()[set].name] = ratios[w][set + 1].to_json();
      to.at_most(way.rays()[set].name + "/" + label + "/" + way.name(), ratios[w][set + 1].median(), kMostRatio);
    }
  }
  std::printf("\n");
  print_table(rows);
  std::fflush(stdout);
}

Peers build_instances(const ManyInstances& scene) {
  Peers peers;
  for (const EmbreeScenes scenes : kEmbreeScenes)
    if (const auto build = prepare_embree_instances(scene.scene.mesh(), scene.rows, scenes, 2))
      peers.push_back(build->build());
  return peers;
}

void measure_instances(Report& to, const Options& options, Crowd crowd, std::uint32_t instances) {
  ManyInstances made = many_instances(crowd, instances);
  const KernelScene& scene = made.scene;
  const std::string label = "instances/" + scene.name;
  const Plan plan = make_plan(*scene.scene, scene.camera, settings_of(options));
  const std::size_t heap_before = heap_bytes();
  const CpuStopwatch watch;
  const auto ours = make_accel(scene.scene, plan.accel);
  const double seconds = watch.seconds();
  const double bytes_each = static_cast<double>(heap_bytes() - heap_before) / instances + sizeof(Object);
  std::printf("\n%s of %zu triangles: ours is made in %.0f ms, %.1f bytes an instance, of which the object is %zu\n",
              label.c_str(), scene.triangles(), 1e3 * seconds, bytes_each, sizeof(Object));
  const std::vector<RaySet> sets = kernel_rays(scene, *ours, options.width);
  const Peers peers = build_instances(made);
  for (const EmbreeScenes kind : kEmbreeScenes)
    if (!peers.empty())
      std::printf("%s%s %.0f", kind == EmbreeScenes::normal ? "Embree's bytes an instance: " : ", ",
                  name(EmbreeMode{kind}).c_str(),
                  static_cast<double>(peers[static_cast<std::size_t>(kind)]->bytes()) / instances);
  std::printf("\n");
  SceneFigures figures{label, scene.triangles(), describe(plan.accel), {}, {}};
  for (const RaySet& set : sets) figures.races.push_back(race(*ours, peers, set, {options.repetitions, {1}}));
  print(figures, {1});
  auto& json = to.figures()["instances"][scene.name];
  json = {{"seconds", seconds}, {"bytes_each", bytes_each}};
  to.at_most("bytes/" + label, bytes_each, kMostBytes);
  for (const Race& race : figures.races)
    if (const Race::Peer* best = race.best(1)) {
      json["rays"][race.rays] = {{"mrays", race.mrays[0].to_json()},
                                 {"embree", name(best->mode)},
                                 {"ours_over_it", best->our_ratio[0].to_json()}};
      to.at_least(race.rays + "/" + label, best->our_ratio[0].median(), 1);
    }
  to.write_plot(speed_chart(figures, {1}), "instances-" + std::string(name(crowd)) + "-" + std::to_string(instances));
  std::fflush(stdout);
}

void measure_all(Report& to, const Options& options) {
  std::printf(
      "Processor time on one thread, medians of repetitions in turns, ± half the distance between the quartiles.\n"
      "whole: plan, structure, and a render of %u x %u pixels, 4 samples each, with shadows, as often as the one "
      "mesh's;\n"
      "the other columns trace rays alone, all hierarchies made.\n",
      options.width, options.width);
  for (const Crowd crowd : kCrowds)
    for (const std::uint32_t each : {12U, 224U})
      for (const std::uint32_t objects : {2'000U, 20'000U, 100'000U}) {
        const std::string label = std::string(name(crowd)) + "/" + std::to_string(objects) + "x" + std::to_string(each);
        if (options.is_quick && objects * each > 500'000) continue;
        if (options.wants(label, objects)) measure_objects(to, options, crowd, objects, each);
      }
  for (const Crowd crowd : kCrowds)
    for (const std::uint32_t instances : {20'000U, 1'000'000U}) {
      if (options.is_quick && instances > 20'000) continue;
      if (options.wants("instances/" + std::string(name(crowd)), instances))
        measure_instances(to, options, crowd, instances);
    }
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera;
  bench::Options options;
  CLI::App app("Measures scenes of many objects.", "tests/bench objects");
  app.add_option("folder", options.folder, "where JSON and plots go; tests/bench gives it")->required();
  app.add_flag("--quick", options.is_quick, "small scenes, a small picture, three repetitions");
  app.add_option("--only", options.only, "scenes whose names contain this: field, swarm, 2000x12, instances, ...");
  app.add_option("--largest", options.largest, "objects of a scene at most");
  auto* width = app.add_option("--width", options.width, "of the square picture");
  width->check(CLI::IsMember({128, 256, 512, 1024}));
  auto* repetitions = app.add_option("--repetitions", options.repetitions)->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  if (options.is_quick && width->count() == 0) options.width = 256;
  if (options.is_quick && repetitions->count() == 0) options.repetitions = 3;
  try {
    bench::Report report("objects", options.folder);
    bench::measure_all(report, options);
    report.finish();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_objects: %s\n", error.what());
    return 1;
  }
}
