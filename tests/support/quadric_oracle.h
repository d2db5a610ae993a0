#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "core/geometry/cone.h"
#include "core/geometry/cylinder.h"
#include "core/geometry/disk.h"
#include "core/geometry/sphere.h"
#include "tests/support/wide.h"

namespace tessera {

/// A crossing of a ray and a surface, in wider precision.
struct ExactCrossing {
  Wide t;
  /// The sine of the angle between ray and surface: t is known to the position's error divided by it.
  Wide steepness;
};

/// All crossings at any t, ascending, and how far (metres) the ray would have to move for their number to change:
/// the distance to the nearest silhouette or rim.
struct Crossings {
  std::vector<ExactCrossing> all;
  Wide margin = 0;
};

inline Vec3w unit(Vec3w v) { return v / std::sqrt(dot(v, v)); }

inline Crossings crossings(const Sphere& sphere, const Ray& ray) {
  const Vec3w d = unit(widen(ray.direction));
  const Vec3w f = widen(sphere.center) - widen(ray.origin);
  const Wide scale = std::sqrt(dot(widen(ray.direction), widen(ray.direction)));
  const Vec3w n = cross(f, d);
  const Wide miss = std::sqrt(dot(n, n)), r = sphere.radius;
  Crossings out{{}, std::abs(miss - r)};
  if (miss > r) return out;
  const Wide half = std::sqrt((r - miss) * (r + miss)), closest = dot(f, d);
  out.all = {{(closest - half) / scale, half / r}, {(closest + half) / scale, half / r}};
  return out;
}

/// The cone in its own frame, z along the axis from the base: solved by walking to the plain quadratic from the
/// point nearest to the middle, in unit lengths.
inline Crossings crossings(const Cone& cone, const Ray& ray) {
  const Vec3w base = widen(cone.base), apex = widen(cone.apex), origin = widen(ray.origin);
  const Wide height = std::sqrt(dot(apex - base, apex - base));
  const Vec3w z = (apex - base) / height;
  const Vec3w x = unit(std::abs(z.x) < 0.7L ? cross(z, {1, 0, 0}) : cross(z, {0, 1, 0})), y = cross(z, x);
  const Wide scale = std::sqrt(dot(widen(ray.direction), widen(ray.direction)));
  const Vec3w d = widen(ray.direction) / scale;
  const Vec3w from_middle = (origin - base) - (height / 2) * z;
  const Wide start = -dot(from_middle, d);
  const Vec3w near = from_middle + start * d;
  const Vec3w o{dot(near, x), dot(near, y), dot(near, z) + height / 2};
  const Vec3w v{dot(d, x), dot(d, y), dot(d, z)};
  const Wide slope = (static_cast<Wide>(cone.apex_radius) - cone.base_radius) / height;
  const Wide ro = cone.base_radius + slope * o.z, rv = slope * v.z;

  const Wide a = v.x * v.x + v.y * v.y - rv * rv;
  const Wide b = o.x * v.x + o.y * v.y - ro * rv;
  const Wide c = o.x * o.x + o.y * o.y - ro * ro;
  const Wide discriminant = b * b - a * c;
  Crossings out;
  const Wide widest = std::max(cone.base_radius, cone.apex_radius);
  const Wide size = std::hypot(height / 2, widest);
  // F = x² + y² − ρ² has the minimum or maximum −discriminant / a along the ray: a silhouette where that is 0.
  const Wide gradient = 2 * std::max(std::abs(ro), widest) * std::hypot(1, slope);
  out.margin = a == 0 ? 0 : std::abs(discriminant / a) / gradient;
  if (discriminant < 0) return out;
  const Wide q = -(b + std::copysign(std::sqrt(discriminant), b));
  for (const Wide t : {q / a, c / q}) {
    if (!std::isfinite(t)) continue;
    const Wide h = o.z + t * v.z;
    if (std::abs(t) < 4 * size) out.margin = std::min({out.margin, std::abs(h), std::abs(h - height)});
    if (h < 0 || h > height) continue;
    const Wide radius = cone.base_radius + slope * h;
    out.margin = std::min(out.margin, radius);
    const Vec3w normal{o.x + t * v.x, o.y + t * v.y, -slope * radius};
    out.all.push_back({(start + t) / scale, std::abs(dot(unit(normal), v))});
  }
  std::ranges::sort(out.all, {}, &ExactCrossing::t);
  return out;
}

inline Crossings crossings(const Cylinder& c, const Ray& ray) {
  return crossings(Cone{c.base, c.radius, c.apex, c.radius}, ray);
}

inline Crossings crossings(const Disk& disk, const Ray& ray) {
  const Vec3w n = unit(widen(disk.normal)), d = widen(ray.direction);
  const Vec3w f = widen(disk.center) - widen(ray.origin);
  const Wide along = dot(n, d);
  if (along == 0) return {{}, kInfinity};
  const Wide t = dot(n, f) / along;
  const Vec3w p = t * d - f;
  const Wide out = std::sqrt(dot(p, p)) - disk.radius;
  Crossings found{{}, std::abs(out) * std::abs(along) / std::sqrt(dot(d, d))};
  if (out <= 0) found.all = {{t, std::abs(along) / std::sqrt(dot(d, d))}};
  return found;
}

/// The distance of a point to the surface.
inline Wide distance(const Sphere& sphere, Vec3w p) {
  const Vec3w v = p - widen(sphere.center);
  return std::abs(std::sqrt(dot(v, v)) - sphere.radius);
}

/// In the half plane of axis and point the cone is a line segment.
inline Wide distance(const Cone& cone, Vec3w p) {
  const Vec3w axis = widen(cone.apex) - widen(cone.base), v = p - widen(cone.base);
  const Wide height = std::sqrt(dot(axis, axis));
  const Wide h = dot(v, axis) / height;
  const Vec3w across = v - (h / height) * axis;
  const Wide x = std::sqrt(dot(across, across)) - cone.base_radius;
  const Wide sx = static_cast<Wide>(cone.apex_radius) - cone.base_radius;
  const Wide along = std::clamp((x * sx + h * height) / (sx * sx + height * height), 0.0L, 1.0L);
  return std::hypot(x - along * sx, h - along * height);
}

inline Wide distance(const Cylinder& c, Vec3w p) { return distance(Cone{c.base, c.radius, c.apex, c.radius}, p); }

inline Wide distance(const Disk& disk, Vec3w p) {
  const Vec3w n = unit(widen(disk.normal)), v = p - widen(disk.center);
  const Wide h = dot(n, v);
  const Vec3w across = v - h * n;
  return std::hypot(h, std::max<Wide>(0, std::sqrt(dot(across, across)) - disk.radius));
}

/// The outward normal at a point of the surface, unit.
inline Vec3w outward_normal(const Sphere& sphere, Vec3w p) { return unit(p - widen(sphere.center)); }
inline Vec3w outward_normal(const Disk& disk, Vec3w) { return unit(widen(disk.normal)); }
inline Vec3w outward_normal(const Cone& cone, Vec3w p) {
  const Vec3w axis = widen(cone.apex) - widen(cone.base), v = p - widen(cone.base);
  const Vec3w across = v - (dot(v, axis) / dot(axis, axis)) * axis;
  const Wide widening = static_cast<Wide>(cone.apex_radius) - cone.base_radius;
  return unit(unit(across) - (widening / dot(axis, axis)) * axis);
}
inline Vec3w outward_normal(const Cylinder& c, Vec3w p) {
  return outward_normal(Cone{c.base, c.radius, c.apex, c.radius}, p);
}

/// How far the surface's curvature lets the normal turn when the point is off by `error`, at most: 1 / radius.
inline Wide curvature(const Sphere& sphere, Vec3w) { return 1 / static_cast<Wide>(sphere.radius); }
inline Wide curvature(const Disk&, Vec3w) { return 0; }
inline Wide curvature(const Cone& cone, Vec3w p) {
  const Vec3w axis = widen(cone.apex) - widen(cone.base), v = p - widen(cone.base);
  const Vec3w across = v - (dot(v, axis) / dot(axis, axis)) * axis;
  return 1 / std::sqrt(dot(across, across));
}
inline Wide curvature(const Cylinder& c, Vec3w) { return 1 / static_cast<Wide>(c.radius); }

}  // namespace tessera
