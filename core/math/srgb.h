#pragma once

namespace tessera {

/// The linear light, 0 to 1, that sRGB's curve (IEC 61966-2-1) makes of an encoded value, clamped to 0..1. NaN becomes
/// 0. The same bits on every machine.
float light_of_encoded(double encoded);

}  // namespace tessera
