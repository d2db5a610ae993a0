#pragma once

#include <cstdint>

namespace tessera {

/// The bits of the 16-bit float (IEEE 754 binary16) nearest to `v`, ties to even. A finite number beyond its greatest,
/// 65504, becomes that, as a highlight shouldn't become infinite; infinities and NaN stay what they are.
std::uint16_t half_bits(float v);

}  // namespace tessera
