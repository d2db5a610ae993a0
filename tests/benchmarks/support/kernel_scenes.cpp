#include "tests/benchmarks/support/kernel_scenes.h"

#include <cstdio>

#include "tests/benchmarks/support/bench_camera.h"
#include "tests/benchmarks/support/kernel_interior.h"
#include "tests/benchmarks/support/kernel_meshes.h"
#include "tests/benchmarks/support/terrain.h"
#include "tests/support/imported_scene.h"
#include "tests/support/scenes.h"
#include "tests/support/shared_data.h"

namespace tessera::bench {
namespace {

std::shared_ptr<const Scene> alone(TriangleMesh mesh) { return SceneBuilder().add(std::move(mesh)).build(); }

/// The mesh fills the picture, lit from the left above.
KernelScene framed(std::string_view name, TriangleMesh mesh) {
  auto scene = alone(std::move(mesh));
  PerspectiveCamera camera = bench_camera(*scene);
  camera.vertical_fov *= 0.6F;  // the frame has room for the whole box, at any angle
  const Vec3 size = world_bounds(*scene, scene->objects.front()).diagonal();
  const Vec3 light = camera.view.from + Vec3{-size.x, size.y, 0};
  return {std::string(name), std::move(scene), camera, light};
}

TriangleMesh bunny() {
  if (const auto data = shared_data())
    if (const auto scene = imported_scene(*data / "meshes/stanford-bunny.obj"))
      return std::get<TriangleMesh>(scene->shapes.front());
  std::printf("no bunny in shared/data beside this checkout: a made body of as many triangles stands in\n");
  return organic(70'000);
}

}  // namespace

KernelScene kernel_scene(std::string_view name) {
  if (name == "bunny") return framed(name, bunny());
  if (name == "organic_100k") return framed(name, organic(100'000));
  if (name == "organic_1600k") return framed(name, organic(1'600'000));
  if (name == "flake") return framed(name, mesh_flake());
  if (name == "interior") {
    Interior rooms = interior();
    return {std::string(name), alone(std::move(rooms.mesh)), rooms.camera, rooms.light};
  }
  const PerspectiveCamera over_the_hills{{{0.5F, 0.4F, 1.2F}, {0.5F, 0, 0.45F}, {0, 1, 0}}, 0.8F};
  return {std::string(name), alone(terrain(2'000'000)), over_the_hills, {0.2F, 0.8F, 0.3F}};
}

}  // namespace tessera::bench
