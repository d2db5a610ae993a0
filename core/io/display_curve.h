#pragma once

#include <cstdint>

namespace tessera {

/// sRGB's transfer curve (IEC 61966-2-1) on a value of linear light clamped to 0..1, as a byte: 255 times the curve,
/// rounded, halves up. NaN becomes 0. The first call makes a table, in some 0.3 ms; safe to call from any thread.
std::uint8_t display_byte(float linear);

/// The linear light, 0 to 1, that `display_byte` makes that byte of. The same bits on every machine.
float display_light(std::uint8_t byte);

}  // namespace tessera
