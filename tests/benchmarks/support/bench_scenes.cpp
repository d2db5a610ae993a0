#include "tests/benchmarks/support/bench_scenes.h"

#include <cstdio>

#include "core/scene/frame_scene.h"
#include "tests/support/imported_scene.h"
#include "tests/support/scenes.h"
#include "tests/support/shared_data.h"

namespace tessera::bench {
namespace {

/// Reflects and transmits, so that a mesh alone brings rays of every kind.
constexpr Material kEveryRay{
    .diffuse = {0.5F, 0.5F, 0.5F}, .reflect = {0.2F, 0.2F, 0.2F}, .transmit = {0.3F, 0.3F, 0.3F}, .ior = 1.5F};

/// The mesh on a floor, lit by a point light beside the camera.
BenchScene on_a_floor(std::string name, Scene scene, bool from_issue) {
  Aabb box;
  for (const Object& object : scene.objects) box.extend(world_bounds(scene, object));
  const Vec3 size = box.diagonal(), lo = box.lo - size, hi = box.hi + size;
  scene.camera = frame_scene(scene);
  for (Material& material : scene.materials) material = kEveryRay;
  scene.materials.emplace_back();
  scene.shapes.emplace_back(
      Quad{{{{lo.x, box.lo.y, hi.z}, {hi.x, box.lo.y, hi.z}, {hi.x, box.lo.y, lo.z}, {lo.x, box.lo.y, lo.z}}}});
  scene.objects.push_back({static_cast<std::uint32_t>(scene.shapes.size() - 1),
                           static_cast<std::uint32_t>(scene.materials.size() - 1), std::nullopt});
  scene.lights = {PointLight{
      std::get<PerspectiveCamera>(*scene.camera).view.from + Vec3{-size.x, 2 * size.y, 0}, {1, 1, 1}, false}};
  const Camera camera = *scene.camera;
  return {std::move(name), std::make_shared<const Scene>(std::move(scene)), camera, from_issue};
}

}  // namespace

std::vector<BenchScene> bench_scenes() {
  std::vector<BenchScene> scenes;
  const auto data = shared_data();
  if (!data) std::printf("skipped: Haines' scenes and the meshes (shared/data isn't beside this checkout)\n");
  const auto load = [&](const std::string& file) -> std::shared_ptr<Scene> {
    if (!data) return nullptr;
    auto scene = imported_scene(*data / file);
    if (!scene) std::printf("skipped: %s is missing or broken\n", file.c_str());
    return scene;
  };
  for (const std::string name : {"balls-s4", "gears-s4", "mount-s6", "rings-s7", "teapot-s12", "tetra-s6", "tree-s11"})
    if (const auto scene = load("spd-nff/" + name + ".nff")) scenes.push_back({name, scene, *scene->camera, true});
  for (const std::string file : {"stanford-bunny.obj", "igea.ply", "rocker-arm.obj"})
    if (const auto scene = load("meshes/" + file))
      scenes.push_back(on_a_floor(file.substr(0, file.find('.')), std::move(*scene), true));

  Scene sphere;
  sphere.shapes.emplace_back(icosphere(6));
  sphere.objects.push_back({});
  sphere.materials.emplace_back();
  scenes.push_back(on_a_floor("icosphere", std::move(sphere), false));
  scenes.push_back({"mixed", mixed_scene(), mixed_camera(), false});
  scenes.push_back({"sparse", sparse_scene(), mixed_camera(), false});
  return scenes;
}

}  // namespace tessera::bench
