#pragma once

#include "core/math/rounding.h"

namespace tessera {

/// A closed interval of ray parameters.
struct Interval {
  float lo = -kInfinity;
  float hi = kInfinity;

  constexpr bool operator==(const Interval&) const = default;
};

}  // namespace tessera
