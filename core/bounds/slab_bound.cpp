#include "core/bounds/slab_bound.h"

#include <algorithm>
#include <cmath>

#include "core/bounds/cull_pad.h"

namespace tessera {
namespace {

double length1(Vec3d n) { return std::abs(n.x) + std::abs(n.y) + std::abs(n.z); }

/// The same direction with a largest component in [1/2, 1), exactly: so that n·p neither overflows nor vanishes.
Vec3d scaled(Vec3 normal) {
  const Vec3d n = to_double(normal);
  int exponent;
  std::frexp(max_component(abs(n)), &exponent);
  return {std::ldexp(n.x, -exponent), std::ldexp(n.y, -exponent), std::ldexp(n.z, -exponent)};
}

/// Wider than any slab between floats: the length of what has no end.
constexpr double kEndless = 1e40;

/// Three normals at larger angles than this (its sine) span space, or two of them a plane.
constexpr double kLeastSine = 1e-6;

}  // namespace

/// What is rounded beside what `cull_pad` has: n·o, three times, at most 2^-53 · |n|₁ · |o|∞ each.
SlabClipper::SlabClipper(std::span<const Vec3d> normals, const Ray& ray, const Aabb& reach, Transform::Error placed) {
  const Vec3d o = to_double(ray.origin), d = to_double(ray.direction);
  const double pad = cull_pad(ray, reach, placed) + 0x1p-50 * max_component(abs(o));
  const double least = kLeastSlope * max_component(abs(d));
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const double n1 = length1(normals[i]);
    const double inverse = 1 / at_least(least * n1, dot(normals[i], d));
    crossings_[i] = {dot(normals[i], o), inverse, pad * n1 * std::abs(inverse)};
  }
}

SlabBound::SlabBound(std::span<const Vec3> normals) {
  for (const Vec3 n : normals) normals_.push_back(scaled(n));

  // The first normal, the one at the widest angle to it, and the one that with both encloses the largest volume.
  Vec3d chosen[3] = {normals_[0] / length(normals_[0])};
  sides_[0] = {0, 1 / length(normals_[0])};
  double spanned = 1;
  const auto choose = [&](int side, auto&& span) {
    double most = kLeastSine;
    for (int i = 0; i < static_cast<int>(normals_.size()); ++i) {
      const double inverse_length = 1 / length(normals_[i]);
      const Vec3d unit = normals_[i] * inverse_length;
      if (span(unit) <= most) continue;
      most = spanned = span(unit);
      chosen[side] = unit;
      sides_[side] = {i, inverse_length};
    }
  };
  choose(1, [&](Vec3d n) { return length(cross(chosen[0], n)); });
  if (sides_[1].slab >= 0) choose(2, [&](Vec3d n) { return std::abs(dot(cross(chosen[0], chosen[1]), n)); });
  inverse_volume_ = 1 / spanned;
}

Slabs SlabBound::fit(Outline& outline) const {
  if (outline.empty()) return Slabs(normals_.size(), kEmptyInterval);
  Slabs slabs;
  slabs.reserve(normals_.size());
  std::vector<bool> outermost(outline.points.size() + outline.ellipsoids.size());
  for (const Vec3d n : normals_) {
    const Extent extent = extent_along(n, outline);
    slabs.push_back({below(extent.lo), above(extent.hi)});
    outermost[extent.lowest] = outermost[extent.highest] = true;
  }
  outline.slack += extent_rounding(outline);
  keep(outline, outermost);
  return slabs;
}

Slabs SlabBound::join(const Slabs& a, const Slabs& b) const {
  Slabs both(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) both[i] = {std::min(a[i].lo, b[i].lo), std::max(a[i].hi, b[i].hi)};
  return both;
}

bool SlabBound::contains(const Slabs& slabs, Vec3 p) const {
  for (std::size_t i = 0; i < slabs.size(); ++i) {
    const double at = dot(normals_[i], to_double(p));
    if (!(slabs[i].lo <= at && at <= slabs[i].hi)) return false;
  }
  return true;
}

double SlabBound::cost(const Slabs& slabs) const {
  if (slabs[0].lo > slabs[0].hi) return 0;
  double width[3];
  for (int side = 0; side < 3; ++side) {
    const auto [slab, inverse_length] = sides_[side];
    width[side] = kEndless;
    if (slab < 0) continue;
    const double across = static_cast<double>(slabs[slab].hi) - slabs[slab].lo;
    width[side] = std::min(kEndless, across * inverse_length);
  }
  return (width[0] * width[1] + width[1] * width[2] + width[2] * width[0]) * inverse_volume_;
}

}  // namespace tessera
