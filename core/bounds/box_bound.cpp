#include "core/bounds/box_bound.h"

namespace tessera {

Aabb BoxBound::fit(Outline& outline) const {
  const Extent x = extent_along({1, 0, 0}, outline), y = extent_along({0, 1, 0}, outline),
               z = extent_along({0, 0, 1}, outline);
  if (x.lo > x.hi) return {};
  return outward({x.lo, y.lo, z.lo}, {x.hi, y.hi, z.hi});
}

Aabb BoxBound::join(const Aabb& a, const Aabb& b) const {
  Aabb both = a;
  both.extend(b);
  return both;
}

}  // namespace tessera
