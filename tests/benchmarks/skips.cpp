// What a scene holds and doesn't need costs nothing: scenes with it against the same scenes without.
//
// tests/bench skips
#include <cstdio>
#include <exception>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/benchmarks/support/kernel_meshes.h"
#include "tests/benchmarks/support/render_image.h"
#include "tests/benchmarks/support/report.h"
#include "tests/support/scenes.h"

namespace tessera::bench {
namespace {

constexpr int kRepetitions = 9;
constexpr double kBar = 1.02;

/// Something that the plan skips, added to a scene of a mesh and a lamp that doesn't need it.
struct Skipped {
  std::string name, what;
  std::function<void(SceneBuilder&)> add;
};

const std::vector<Skipped> kSkipped = {
    {"objects", "1000 spheres behind the camera",
     [](SceneBuilder& scene) {
       const std::uint32_t ball = scene.shape(Sphere{{0, 0, 0}, 0.1F});
       for (int i = 0; i < 1000; ++i) {
         const double x = i % 10 - 5, y = i / 10 % 10 - 5, z = 20 + i / 100;
         scene.place(ball, 0, placed({1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z}));
       }
     }},
    {"meshes", "a mesh of a million triangles behind the camera",
     [](SceneBuilder& scene) {
       scene.place(scene.shape(organic(1'000'000)), 0, placed({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 20}));
     }},
    {"reflection_rays", "a mirror's material, not in use",
     [](SceneBuilder& scene) { scene.material(mirror_material()); }},
    {"refraction_rays", "glass, not in use", [](SceneBuilder& scene) { scene.material(glass_material()); }},
};

/// A body beside a sphere, so that there are objects to choose from.
SceneBuilder needed() {
  SceneBuilder scene;
  scene.material(diffuse({0.7F, 0.6F, 0.5F}));
  scene.add(organic(100'000)).add(Sphere{{2, 0, 0}, 0.5F});
  scene.light(PointLight{{3, 4, 5}, {60, 60, 60}});
  return scene;
}

/// Processor time from plan to image, on one thread.
double seconds_to_render(const std::shared_ptr<const Scene>& scene) {
  Settings settings;
  settings.width = settings.height = 512;
  settings.samples = 4;
  settings.accel.kind = AccelKind::wide;
  const CpuStopwatch watch;
  render(prepare(scene, PerspectiveCamera{{{0, 1, 6}, {0.5F, 0, 0}, {0, 1, 0}}, 0.6F}, settings), 1);
  return watch.seconds();
}

void run(const char* folder) {
  Report report("skips", folder);
  std::vector<std::vector<std::string>> table = {{"not needed", "ms without", "ms with", "with / without"}};
  const auto without = needed().build();
  for (const Skipped& skipped : kSkipped) {
    SceneBuilder builder = needed();
    skipped.add(builder);
    const auto with = builder.build();
    Samples plain, burdened, ratio;
    for (int i = 0; i < kRepetitions; ++i) {
      plain.add(1e3 * seconds_to_render(without));
      burdened.add(1e3 * seconds_to_render(with));
      ratio.add(burdened.last() / plain.last());
    }
    table.push_back({skipped.what, with_spread(plain), with_spread(burdened), with_spread(ratio, 3)});
    report.figures()[skipped.name] = {
        {"without_ms", plain.to_json()}, {"with_ms", burdened.to_json()}, {"ratio", ratio.to_json()}};
    report.at_most("skips." + skipped.name, ratio.median(), kBar);
  }
  print_table(table);
  report.finish();
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) try {
  if (argc < 2) throw std::runtime_error("usage: tests/bench skips");
  tessera::bench::run(argv[1]);
} catch (const std::exception& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
