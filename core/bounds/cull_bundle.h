#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <span>
#include <utility>

#include "core/bounds/aabb.h"
#include "core/bounds/cull_pad.h"
#include "core/bounds/cull_ray.h"
#include "core/math/interval.h"
#include "core/math/ray.h"
#include "core/math/transform.h"

namespace tessera {

/// Rays clipped against boxes all at once (by interval arithmetic, as Boulos et al. cull packets in "Geometric and
/// Arithmetic Culling Methods for Entire Ray Packets", 2006). It only turns away what a `CullRay` of each would: its
/// numbers are bounds of theirs, since every operation between is monotone, rounding included. An axis along which the
/// rays don't all run the same way, or hardly run, isn't clipped.
class CullBundle {
 public:
  /// Precondition: there are rays, and all are traceable.
  CullBundle(std::span<const Ray> rays, const Aabb& reach, Transform::Error placed) {
    const auto [lo, hi] = range(rays);
    t_min_ = lo.t_min;
    t_max_ = hi.t_max;
    // Of a ray in between, one of the two pads' terms may be that of one end and the other that of the other.
    const double pad = cull_pad(lo, reach, placed) + cull_pad(hi, reach, placed);
    const float least = std::max(max_component(abs(lo.direction)), max_component(abs(hi.direction))) * kLeastSlope;
    for (int i = 0; i < 3; ++i) {
      Axis& axis = axes_[static_cast<std::size_t>(i)];
      const float from = lo.direction[i], to = hi.direction[i];
      axis.down = to < 0;
      axis.clips = (from > 0 || to < 0) && std::min(std::abs(from), std::abs(to)) >= least;
      axis.origin_lo = lo.origin[i];
      axis.origin_hi = hi.origin[i];
      axis.inverse[0] = 1 / from;
      axis.inverse[1] = 1 / to;
      const float steepest = std::max(std::abs(axis.inverse[0]), std::abs(axis.inverse[1]));
      axis.pad = static_cast<float>(pad * steepest + kDenormalSlack);
      axis.clips = axis.clips && std::isfinite(steepest);
    }
  }

  /// Whether no hit of any of the rays at t ≤ limit can lie in a box.
  bool misses(const Aabb& box, float limit) const {
    Interval span;
    for (int i = 0; i < 3; ++i) {
      const Axis& axis = axes_[static_cast<std::size_t>(i)];
      if (!axis.clips) continue;
      // The least way to the nearer plane, and the farthest to the other; down an axis both are negative.
      const float to_lo = box.lo[i] - axis.origin_hi, to_hi = box.hi[i] - axis.origin_lo;
      const float to_near = axis.down ? to_hi : to_lo, to_far = axis.down ? to_lo : to_hi;
      const float near = std::min(to_near * axis.inverse[0], to_near * axis.inverse[1]) - axis.pad;
      const float far = std::max(to_far * axis.inverse[0], to_far * axis.inverse[1]) + axis.pad;
      span.lo = near > span.lo ? near : span.lo;
      span.hi = far < span.hi ? far : span.hi;
    }
    return CullRay::misses(span, t_min_, std::min(limit, t_max_));
  }

 private:
  struct Axis {
    float origin_lo, origin_hi;
    float inverse[2];
    float pad;
    bool down;
    bool clips;
  };

  /// Each number's least and greatest value.
  static std::pair<Ray, Ray> range(std::span<const Ray> rays) {
    using Four = float __attribute__((vector_size(16)));  // the compiler's own vectors, as in `CullRay`
    using Numbers = std::array<Four, 2>;
    static_assert(offsetof(Ray, leaves) == sizeof(Numbers));
    const auto numbers = [](const Ray& ray) {
      Numbers out;
      std::memcpy(&out, &ray, sizeof out);
      return out;
    };
    Numbers lo = numbers(rays[0]), hi = lo;
    for (const Ray& ray : rays.subspan(1)) {
      const Numbers at = numbers(ray);
      for (std::size_t k = 0; k < at.size(); ++k) {
        lo[k] = at[k] < lo[k] ? at[k] : lo[k];
        hi[k] = at[k] > hi[k] ? at[k] : hi[k];
      }
    }
    std::pair<Ray, Ray> out;
    std::memcpy(static_cast<void*>(&out.first), &lo, sizeof lo);
    std::memcpy(static_cast<void*>(&out.second), &hi, sizeof hi);
    return out;
  }

  float t_min_, t_max_;
  std::array<Axis, 3> axes_;
};

}  // namespace tessera
