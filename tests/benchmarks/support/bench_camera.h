#pragma once

#include "core/math/portable.h"
#include "core/scene/scene.h"

namespace tessera::bench {

/// So far off that a square image has room for a ball around the scene's box, at any angle. Farther than `frame_scene`
/// would stand, and the same in every version, so that figures compare.
inline PerspectiveCamera bench_camera(const Scene& scene) {
  Aabb box;
  for (const Aabb& object : world_bounds(scene)) box.extend(object);
  PerspectiveCamera camera;
  camera.view.at = to_float(0.5 * (to_double(box.lo) + to_double(box.hi)));
  const Vec3d center = to_double(camera.view.at);
  const double radius = 0.5 * length(to_double(box.hi) - to_double(box.lo)) + 8 * kUnitRoundoff * length(center);
  const double distance = radius / portable_sin(0.5 * static_cast<double>(camera.vertical_fov));
  const Vec3d toward_viewer{0.4, 0.35, 1};
  camera.view.from = to_float(center + (distance / length(toward_viewer)) * toward_viewer);
  return camera;
}

}  // namespace tessera::bench
