#pragma once

#include <cstdint>

#include "core/bounds/aabb.h"

namespace tessera {

/// A value for each axis, and a fourth that is carried along: the compiler's own vectors, which every machine has in
/// some form.
using Lanes = float __attribute__((vector_size(16)));
using IntLanes = std::int32_t __attribute__((vector_size(16)));
using WordLanes = std::uint32_t __attribute__((vector_size(16)));

inline Lanes min(Lanes a, Lanes b) { return a < b ? a : b; }
inline Lanes max(Lanes a, Lanes b) { return a > b ? a : b; }
inline Lanes spread(float x) { return Lanes{x, x, x, x}; }

/// An `Aabb` for those who work on many. Uninitialised by default.
struct LanesBox {
  Lanes lo, hi;

  static LanesBox empty() { return {spread(kInfinity), spread(-kInfinity)}; }

  void extend(Lanes p) {
    lo = min(lo, p);
    hi = max(hi, p);
  }
  void extend(const LanesBox& b) {
    lo = min(lo, b.lo);
    hi = max(hi, b.hi);
  }
  bool is_empty() const { return !(lo[0] <= hi[0] && lo[1] <= hi[1] && lo[2] <= hi[2]); }
  Aabb aabb() const { return {{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}}; }
};

/// Half the surface area in units of 1/`unit`²: a unit of about the scene's size keeps it within floats.
inline float half_area(const LanesBox& box, float unit) {
  const Lanes d = (box.hi - box.lo) * spread(unit);
  return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
}

}  // namespace tessera
