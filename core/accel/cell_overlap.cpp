#include "core/accel/cell_overlap.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

bool boxes_overlap(const Aabb& a, const Aabb& b) {
  return a.lo.x <= b.hi.x && b.lo.x <= a.hi.x && a.lo.y <= b.hi.y && b.lo.y <= a.hi.y && a.lo.z <= b.hi.z &&
         b.lo.z <= a.hi.z;
}

bool triangle_touches(const std::array<Vec3, 3>& corners, const Aabb& cell) {
  const Vec3d center = (to_double(cell.lo) + to_double(cell.hi)) * 0.5;
  Vec3d half = (to_double(cell.hi) - to_double(cell.lo)) * 0.5;
  const Vec3d a = to_double(corners[0]) - center, b = to_double(corners[1]) - center,
              c = to_double(corners[2]) - center;
  // The margin dwarfs the rounding of what follows, which is some 2^-48 of the coordinates.
  const double margin =
      0x1p-40 * (max_component(max(abs(a), max(abs(b), abs(c)))) + max_component(half) + max_component(abs(center)));
  half = half + Vec3d{margin, margin, margin};

  const auto separates = [&](Vec3d axis) {
    const double pa = dot(axis, a), pb = dot(axis, b), pc = dot(axis, c);
    const double radius = dot(abs(axis), half);
    return std::min({pa, pb, pc}) > radius || std::max({pa, pb, pc}) < -radius;
  };
  const Vec3d ab = b - a, bc = c - b, ca = a - c;
  if (separates(cross(ab, bc))) return false;
  for (const Vec3d edge : {ab, bc, ca})
    if (separates({0, -edge.z, edge.y}) || separates({edge.z, 0, -edge.x}) || separates({-edge.y, edge.x, 0}))
      return false;
  return true;
}

}  // namespace

bool touches(const Items& items, std::uint32_t item, const Aabb& cell) {
  if (!boxes_overlap(items.boxes()[item], cell)) return false;
  const auto corners = items.triangle(item);
  return !corners || triangle_touches(*corners, cell);
}

}  // namespace tessera
