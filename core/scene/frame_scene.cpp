#include "core/scene/frame_scene.h"

#include "core/math/float_environment.h"
#include "core/math/portable.h"

namespace tessera {

Camera frame_scene(const Scene& scene) {
  const StrictFloats strict;
  Aabb box;
  for (const Aabb& object : world_bounds(scene)) box.extend(object);
  if (box.empty()) box = {{-0.5F, -0.5F, -0.5F}, {0.5F, 0.5F, 0.5F}};

  PerspectiveCamera camera;
  camera.view.at = to_float(0.5 * (to_double(box.lo) + to_double(box.hi)));
  const Vec3d center = to_double(camera.view.at);
  // A sphere around the box, with room for the rounding of `from` and `at`, touches the square image's edges.
  const double rounding = 8 * kUnitRoundoff * length(center);
  const double radius = 0.5 * length(to_double(box.hi) - to_double(box.lo)) + rounding;
  const double distance = (radius > 0 ? radius : 1) / portable_sin(0.5 * static_cast<double>(camera.vertical_fov));
  const Vec3d toward_viewer{0.4, 0.35, 1};
  camera.view.from = to_float(center + (distance / length(toward_viewer)) * toward_viewer);
  return camera;
}

}  // namespace tessera
