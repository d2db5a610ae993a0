#include "core/integrator/leaving_rays.h"

#include "core/integrator/spawn.h"

namespace tessera {

std::optional<LeavingRays::Leaving> LeavingRays::find(const Shading& at, PrimitiveId primitive, Vec3 origin,
                                                      Vec3 direction, bool reflects) {
  const Vec3 outward = reflects ? at.flat_normal : -at.flat_normal;
  if (dot(direction, outward) > 0) {
    const Vec3 start = reflects ? origin : spawn_origin(at.surface, to_double(outward));
    return Leaving{{start, direction, 0, kInfinity, primitive}};
  }
  if (!reflects || !(dot(at.surface.to_smooth, to_double(outward)) > 0)) return std::nullopt;
  const Vec3 smooth_origin = spawn_origin(at.surface, to_double(outward), at.surface.to_smooth);
  if (smooth_origin == origin) return std::nullopt;
  const Vec3 way = to_float(to_double(smooth_origin) - to_double(origin));
  Rgb passed;
  between_.add({origin, way, 0, kJustBeyond, left_by(way, outward, primitive)}, {1, 1, 1}, 0);
  between_.trace(*accel_, {&passed, 1}, counts_, log_);
  if (passed.is_black()) return std::nullopt;
  return Leaving{{smooth_origin, direction, 0, kInfinity, kNoPrimitive}, passed.g};
}

}  // namespace tessera
