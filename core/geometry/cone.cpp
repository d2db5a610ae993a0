#include "core/geometry/cone.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/circle_extent.h"
#include "core/geometry/double_root.h"

namespace tessera {
namespace {

/// A point of the cone: `along` is −½ at the base and ½ at the apex, `radial` points from the axis to it.
struct Root {
  double t;
  double along;
  Vec3d radial;
};

double largest_radius(const Cone& cone) { return std::max(cone.base_radius, cone.apex_radius); }

/// With x the part of a vector across the axis and ρ the cone's radius at its height, the cone is x·x − ρ² = 0:
/// the null cone of the form Q(u, v) = u.x·v.x − u.ρ·v.ρ, and the ray is a line u + t·v in the space of (x, ρ).
///
/// What rounds (ε = 2^-53, R the larger radius). The origin is moved along the ray twice. First to where the ray
/// passes the cone's middle, known to 4·ε·M: nothing is lost to a camera far away. Then, no farther than the cone
/// reaches, to where |u| is least, hence at most the √2·R of a point on the cone: nothing is lost to a cone much
/// flatter or longer than it is wide. The discriminant Q(u,v)² − Q(u,u)·Q(v,v) is taken from the minors of (u, v),
/// to which it is equal, since their errors are proportional to themselves. That leaves x·x − ρ² = 0 met to
/// kFormError·R²: across the surface some ε·R away from a tip, up to 2^-24·R at a tip, which `bounds` allows for.
/// (Cones more than 1e5 times as long as wide lose up to 1e-10 of their length.)
std::optional<Root> first_root(const Cone& cone, const Ray& ray) {
  const Vec3d d = to_double(ray.direction);
  const Vec3d base = to_double(cone.base) - to_double(ray.origin);
  const Vec3d axis = to_double(cone.apex) - to_double(cone.base);
  const Vec3d middle = base + 0.5 * axis;
  const double dd = dot(d, d), aa = dot(axis, axis);
  const double to_middle = dot(middle, d) / dd;
  const Vec3d o = to_middle * d - middle;

  const double widening = static_cast<double>(cone.apex_radius) - cone.base_radius;
  const double d_along = dot(d, axis) / aa, o_along = dot(o, axis) / aa;
  const Vec3d d_across = d - d_along * axis, o_across = o - o_along * axis;
  const double d_radius = widening * d_along;
  const auto radius_at = [&](double along) { return cone.base_radius + widening * (along + 0.5); };

  const double reach = std::sqrt((aa + largest_radius(cone) * largest_radius(cone)) / dd);
  const double to_least =
      -(dot(o_across, d_across) + radius_at(o_along) * d_radius) / (dot(d_across, d_across) + d_radius * d_radius);
  const double moved = std::clamp(to_least, -reach, reach);
  const double start_along = o_along + moved * d_along;
  const Vec3d start = o_across + moved * d_across;
  const double start_radius = radius_at(start_along);

  const Vec3d minors = d_radius * start - start_radius * d_across;
  const double twist = dot(axis, cross(start, d_across));
  const double discriminant = dot(minors, minors) - twist * twist / aa;
  if (!(discriminant >= 0)) return std::nullopt;

  // Neither root cancels, and `a` may be 0 (a ray parallel to the slant), which leaves the one root c / q.
  const double a = dot(d_across, d_across) - d_radius * d_radius;
  const double b = dot(start, d_across) - start_radius * d_radius;
  const double c = dot(start, start) - start_radius * start_radius;
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  double first = q / a, second = c / q;
  if (first > second) std::swap(first, second);

  // The mirror nappe beyond a tip lies outside [−½, ½], like everything else that isn't between the ends. An
  // infinite or NaN root fails this as well.
  for (const double root : {first, second}) {
    const double along = start_along + root * d_along;
    const double t = to_middle + (moved + root);
    if (along >= -0.5 && along <= 0.5 && accepts(ray, t)) return Root{t, along, start + root * d_across};
  }
  return std::nullopt;
}

/// Of R², see above. The squares of u and t·v are at most 2·R² and 4·R², and each of the form's three products and
/// their discriminant rounds a handful of times: up to 11·ε is seen, 32·ε allowed.
constexpr double kFormError = 0x1p-48;

}  // namespace

std::optional<float> intersect(const Cone& cone, const Ray& ray) {
  const auto root = first_root(cone, ray);
  if (!root) return std::nullopt;
  return static_cast<float>(root->t);
}

SurfacePoint surface(const Cone& cone, const Ray& ray, float t) {
  const Vec3d d = to_double(ray.direction);
  const Vec3d base = to_double(cone.base), apex = to_double(cone.apex);
  const Vec3d axis = apex - base;
  const double aa = dot(axis, axis);
  const auto across = [&](Vec3d v) { return v - (dot(v, axis) / aa) * axis; };

  double along;
  Vec3d radial;
  if (const auto root = first_root(cone, narrowed_to(ray, t))) {
    along = root->along;
    radial = root->radial;
  } else {
    const Vec3d from_base = to_double(ray.origin) - base + static_cast<double>(t) * d;
    along = std::clamp(dot(from_base, axis) / aa - 0.5, -0.5, 0.5);
    radial = across(from_base);
  }
  // On the axis itself (a tip, or a cylinder thinner than rounding) the side that faces the ray will do; a ray that
  // comes down the axis onto a tip sees no side, and the normal below is the axis.
  if (radial == Vec3d{}) radial = -across(d);
  if (radial != Vec3d{}) radial = radial / length(radial);

  const double widening = static_cast<double>(cone.apex_radius) - cone.base_radius;
  const double radius = cone.base_radius + widening * (along + 0.5);
  const Vec3d slanted = radial - (widening / aa) * axis;
  const Vec3d normal = slanted / length(slanted);

  // The sum rounds to 8·ε·(|base| + |apex| + r), and `radial` leaves the plane across the axis by 8·ε of the cone's
  // size. Four times that also covers what `first_root` knows of a ray that starts here, so that one which starts
  // this far off the surface doesn't meet it again.
  const double size = max_component(abs(axis)) + largest_radius(cone);
  const Vec3d error = (32 * kDoubleRoundoff) * (abs(base) + abs(apex) + Vec3d{size, size, size});
  return {base + (along + 0.5) * axis + radius * radial, error, normal, normal};
}

double hit_radius(const Cone& cone, float end_radius) {
  const double largest = largest_radius(cone);
  return std::sqrt(static_cast<double>(end_radius) * end_radius + kFormError * largest * largest);
}

Aabb bounds(const Cone& cone) {
  const Vec3d base = to_double(cone.base), apex = to_double(cone.apex);
  const Vec3d extent = circle_extent(apex - base);
  const Vec3d at_base = hit_radius(cone, cone.base_radius) * extent;
  const Vec3d at_apex = hit_radius(cone, cone.apex_radius) * extent;
  return outward(min(base - at_base, apex - at_apex), max(base + at_base, apex + at_apex));
}

}  // namespace tessera
