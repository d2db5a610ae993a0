#pragma once

#include "core/math/rounding.h"

namespace tessera {

/// A closed interval of ray parameters.
struct Interval {
  float lo = -kInfinity;
  float hi = kInfinity;

  constexpr bool operator==(const Interval&) const = default;
};

/// Contains nothing.
inline constexpr Interval kEmptyInterval{kInfinity, -kInfinity};

}  // namespace tessera
