#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/bounds/bound.h"
#include "core/bounds/slab_presets.h"

namespace tessera {

/// The least and greatest n·p for each of a bound's normals. All empty for nothing; infinite beyond a float.
using Slabs = std::vector<Interval>;

/// A ray set up for slabs: Kay & Kajiya 1986, "Ray Tracing Complex Scenes". It enters the volume where it has entered
/// all slabs, and leaves it with the first that it leaves. In double, since n·p − n·o cancels far from the origin.
class SlabClipper {
 public:
  SlabClipper(std::span<const Vec3d> normals, const Ray& ray, const Aabb& reach, Transform::Error placed);

  Interval clip(const Slabs& slabs) const {
    if (slabs[0].lo > slabs[0].hi) return kEmptyInterval;
    double enter = -kInfinity, leave = kInfinity;
    for (std::size_t i = 0; i < slabs.size(); ++i) {
      const Crossing& c = crossings_[i];
      const double at_lo = (slabs[i].lo - c.origin) * c.inverse, at_hi = (slabs[i].hi - c.origin) * c.inverse;
      enter = std::max(enter, std::min(at_lo, at_hi) - c.pad);
      leave = std::min(leave, std::max(at_lo, at_hi) + c.pad);
      if (enter > leave) return kEmptyInterval;
    }
    return {below(enter), above(leave)};
  }

 private:
  struct Crossing {
    double origin;   ///< n·o
    double inverse;  ///< 1 / n·d
    double pad;      ///< In t.
  };
  std::array<Crossing, kMostNormals> crossings_;  // as many as there are normals; the rest isn't looked at
};

/// Slabs: pairs of parallel planes across normals that the user gives. Where these don't span space the volume has no
/// end in some direction, and is still right.
class SlabBound {
 public:
  using Volume = Slabs;
  using Clipper = SlabClipper;

  /// Precondition: 1 to kMostNormals normals, finite and not zero. Their lengths don't matter.
  explicit SlabBound(std::span<const Vec3> normals);

  /// Leaves of the outline what lies outermost along some normal.
  Slabs fit(Outline& outline) const;
  Slabs join(const Slabs& a, const Slabs& b) const;
  bool contains(const Slabs& slabs, Vec3 p) const;

  /// Half the surface of the parallelepiped between three of the slabs, which contains the volume: with the axes among
  /// the normals, of its axis-aligned box. (The polytope itself would have to be built for its area.)
  double cost(const Slabs& slabs) const;

  std::size_t bytes(const Slabs& slabs) const { return slabs.capacity() * sizeof(Interval); }
  SlabClipper clipper(const Ray& ray, const Aabb& reach, Transform::Error placed = {}) const {
    return {normals_, ray, reach, placed};
  }

 private:
  /// A unit normal's slab among the three that stand for all in `cost`.
  struct Side {
    int slab = -1;  ///< -1: nothing bounds the volume this way.
    double inverse_length = 1;
  };

  std::vector<Vec3d> normals_;
  std::array<Side, 3> sides_;
  double inverse_volume_ = 1;  ///< 1 / |det| of the three unit normals.
};
static_assert(Bound<SlabBound>);

}  // namespace tessera
