#pragma once

#include <algorithm>

#include "core/math/rounding.h"

namespace tessera {

/// A closed interval of ray parameters; empty when `lo > hi`. With a NaN bound it is empty.
struct Interval {
  float lo = -kInfinity;
  float hi = kInfinity;

  constexpr bool empty() const { return !(lo <= hi); }
  constexpr bool operator==(const Interval&) const = default;
};

constexpr Interval intersect(Interval a, Interval b) { return {std::max(a.lo, b.lo), std::min(a.hi, b.hi)}; }

}  // namespace tessera
