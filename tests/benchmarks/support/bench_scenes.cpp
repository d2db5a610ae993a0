#include "tests/benchmarks/support/bench_scenes.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "tests/benchmarks/support/bench_camera.h"
#include "tests/benchmarks/support/terrain.h"
#include "tests/support/imported_scene.h"
#include "tests/support/scenes.h"
#include "tests/support/shared_data.h"

namespace tessera::bench {
namespace {

/// Reflects and transmits, so that a mesh alone brings rays of every kind.
constexpr WhittedSurface kEveryRay{
    .diffuse = {0.5F, 0.5F, 0.5F}, .reflect = {0.2F, 0.2F, 0.2F}, .transmit = {0.3F, 0.3F, 0.3F}, .ior = 1.5F};

/// The mesh on a floor, lit by a point light beside the camera.
BenchScene on_a_floor(std::string name, Scene scene, bool from_issue) {
  Aabb box;
  for (const Object& object : scene.objects) box.extend(world_bounds(scene, object));
  const Vec3 size = box.diagonal(), lo = box.lo - size, hi = box.hi + size;
  const PerspectiveCamera camera = bench_camera(scene);
  for (Material& material : scene.materials) material.surface = kEveryRay;
  scene.materials.emplace_back();
  scene.shapes.emplace_back(
      Quad{{{{lo.x, box.lo.y, hi.z}, {hi.x, box.lo.y, hi.z}, {hi.x, box.lo.y, lo.z}, {lo.x, box.lo.y, lo.z}}}});
  scene.objects.push_back({static_cast<std::uint32_t>(scene.shapes.size() - 1),
                           static_cast<std::uint32_t>(scene.materials.size() - 1), std::nullopt});
  scene.lights = {PointLight{camera.view.from + Vec3{-size.x, 2 * size.y, 0}, {1, 1, 1}, false}};
  scene.camera = camera;
  return {std::move(name), std::make_shared<const Scene>(with_bounds(std::move(scene))), camera, from_issue};
}

/// The room of `interior-kitchen`, a file for each material, seen as its kitchen.scn says. Materials are simplified:
/// metal and black glass are mirrors, tiles and desktop a little; one light beside the camera.
std::optional<BenchScene> kitchen(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (entry.path().extension() == ".ply") files.push_back(entry.path());
  if (files.empty()) return std::nullopt;
  std::ranges::sort(files);  // so that objects have the same numbers everywhere
  Scene scene;
  for (const auto& file : files) {
    const auto part = imported_scene(file);
    if (!part) return std::nullopt;
    const std::string name = file.stem().string();
    const auto is = [&](const char* word) { return name.find(word) != std::string::npos; };
    const float mirror = is("metal") || is("black_glass") ? 0.6F : is("tiles_floor") || is("desktop") ? 0.15F : 0;
    scene.materials.push_back(
        {WhittedSurface{.diffuse = Rgb{1, 1, 1} * (0.7F * (1 - mirror)), .reflect = Rgb{1, 1, 1} * mirror}});
    for (Object object : part->objects) {
      object.material = static_cast<std::uint32_t>(scene.materials.size() - 1);
      scene.shapes.push_back(part->shapes[object.shape]);
      object.shape = static_cast<std::uint32_t>(scene.shapes.size() - 1);
      scene.objects.push_back(object);
    }
  }
  const PerspectiveCamera camera{{{7.634F, -4.168F, 1.422F}, {12.037F, 4.713F, 0.107F}, {0, 0, 1}}, 1.2F};
  scene.lights = {PointLight{camera.view.from + Vec3{0, 0, 0.6F}, {1, 1, 1}, false}};
  return BenchScene{"kitchen", std::make_shared<const Scene>(with_bounds(std::move(scene))), camera, false};
}

/// Small spheres of 1280 triangles each, of many sizes, in a cube.
std::shared_ptr<const Scene> thousand_instances() {
  SceneBuilder b;
  const auto ball = b.shape(icosphere(3));
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const double size = random.magnitude(-1.8, -0.9);
    const Vec3d at = random.in_cube();
    b.place(ball, 0, placed({size, 0, 0, at.x, 0, size, 0, at.y, 0, 0, size, at.z}));
  }
  return b.build();
}

}  // namespace

std::vector<BenchScene> bench_scenes(const std::string& name_part) {
  const auto is_wanted = [&](const std::string& name) { return name.find(name_part) != std::string::npos; };
  std::vector<BenchScene> scenes;
  const auto data = shared_data();
  if (!data) std::printf("skipped: Haines' scenes, the meshes and the kitchen (no shared/data beside this checkout)\n");
  const auto load = [&](const std::string& name, const std::string& file) -> std::shared_ptr<Scene> {
    if (!data || !is_wanted(name)) return nullptr;
    auto scene = imported_scene(*data / file);
    if (!scene) std::printf("skipped: %s is missing or broken\n", file.c_str());
    return scene;
  };
  for (const std::string name : {"balls-s4", "gears-s4", "mount-s6", "rings-s7", "teapot-s12", "tetra-s6", "tree-s11"})
    if (const auto scene = load(name, "spd-nff/" + name + ".nff"))
      scenes.push_back({name, scene, *scene->camera, true});
  for (const std::string file : {"stanford-bunny.obj", "igea.ply", "rocker-arm.obj"}) {
    const std::string name = file.substr(0, file.find('.'));
    if (const auto scene = load(name, "meshes/" + file)) scenes.push_back(on_a_floor(name, std::move(*scene), true));
  }
  if (data && is_wanted("kitchen")) {
    if (auto scene = kitchen(*data / "interior-kitchen"))
      scenes.push_back(std::move(*scene));
    else
      std::printf("skipped: interior-kitchen is missing or broken\n");
  }

  if (is_wanted("icosphere"))
    scenes.push_back(on_a_floor("icosphere", *SceneBuilder().add(icosphere(6)).build(), false));
  if (is_wanted("terrain"))
    scenes.push_back(on_a_floor("terrain", *SceneBuilder().add(terrain(100'000)).build(), false));
  if (is_wanted("instances")) scenes.push_back(on_a_floor("instances", *thousand_instances(), false));
  if (is_wanted("mixed")) scenes.push_back({"mixed", mixed_scene(), mixed_camera(), false});
  if (is_wanted("sparse")) scenes.push_back({"sparse", sparse_scene(), mixed_camera(), false});
  return scenes;
}

}  // namespace tessera::bench
