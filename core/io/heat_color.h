#pragma once

#include <array>
#include <cstdint>

namespace tessera {

/// A ramp for quantities: black at 0, over purple, red and orange, to white at 1. Its lightness (CIE L*) grows evenly,
/// so that equal steps look equal, in grey and to the colour-blind too. `v` is clamped; NaN is black. sRGB bytes.
std::array<std::uint8_t, 3> heat_color(double v);

}  // namespace tessera
