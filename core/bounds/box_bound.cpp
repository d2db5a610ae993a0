#include "core/bounds/box_bound.h"

namespace tessera {

Aabb BoxBound::fit(Outline& outline) const {
  if (outline.empty()) return {};
  Aabb box;
  if (outline.slack == 0 && outline.ellipsoids.empty()) {
    for (const Vec3 p : outline.points) box.extend(p);
  } else {
    const Extent x = extent_along({1, 0, 0}, outline), y = extent_along({0, 1, 0}, outline),
                 z = extent_along({0, 0, 1}, outline);
    box = outward({x.lo, y.lo, z.lo}, {x.hi, y.hi, z.hi});
  }
  outline = {{box.lo, box.hi}, {}, 0};
  return box;
}

Aabb BoxBound::join(const Aabb& a, const Aabb& b) const {
  Aabb both = a;
  both.extend(b);
  return both;
}

}  // namespace tessera
