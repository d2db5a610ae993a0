#pragma once

#include "core/math/rounding.h"

namespace tessera {

/// Returned by a leaf to end a visit: no entry lies before it.
inline constexpr float kStop = -kInfinity;

}  // namespace tessera
