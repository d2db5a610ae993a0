#pragma once

#include <cmath>
#include <cstdint>

#include "core/bounds/cull_pad.h"
#include "core/bounds/cull_ray.h"

namespace tessera {

/// {p: p[axis] = position}.
struct AxisPlane {
  float position = 0;
  std::uint32_t axis = 0;

  /// A ray, ready to cross many planes.
  class Crosser {
   public:
    Crosser(const Ray& ray, const Aabb& reach, Transform::Error placed) : ray_(ray, reach, placed) {}
    Interval clip(const Aabb& box) const { return ray_.clip(box); }
    Crossing cross(const AxisPlane& plane) const { return ray_.cross(static_cast<int>(plane.axis), plane.position); }

   private:
    CullRay ray_;
  };
};

/// {p: normal · p = offset}; the normal of any length but zero.
struct FreePlane {
  Vec3 normal;
  float offset = 0;

  class Crosser {
   public:
    Crosser(const Ray& ray, const Aabb& reach, Transform::Error placed)
        : box_(ray, reach, placed),
          origin_(to_double(ray.origin)),
          direction_(to_double(ray.direction)),
          pad_(cull_pad(ray, reach, placed)),
          least_(kLeastSlope * max_component(abs(direction_))) {}
    Interval clip(const Aabb& box) const { return box_.clip(box); }

    /// In double, whose rounding (2^-50 of the coordinates) the pad covers many times over.
    Crossing cross(const FreePlane& plane) const {
      const Vec3d n = to_double(plane.normal);
      const double n1 = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
      const double nd = dot(n, direction_);
      const double speed = at_least(n1 * least_, nd);
      const double t = (plane.offset - dot(n, origin_)) / speed, pad = n1 * pad_ / std::abs(speed);
      return {static_cast<float>(t - pad), static_cast<float>(t + pad), std::signbit(nd)};
    }

   private:
    CullRay box_;
    Vec3d origin_, direction_;
    double pad_, least_;
  };
};

}  // namespace tessera
