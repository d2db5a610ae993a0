#pragma once

#include <array>
#include <cstdint>

#include "core/math/vec2.h"
#include "core/scene/texture.h"

namespace tessera {

/// A linear colour and alpha, or four numbers as they are.
using Rgba = std::array<float, 4>;

/// One texel, linear: grey in all of the first three, alpha 1 where there is none. 8 and 16 bits are fractions of the
/// largest number. Precondition: x and y are inside.
Rgba texel(const Texels& texels, bool is_srgb, std::uint32_t x, std::uint32_t y);

/// The mean over the colours, and over texels that a lookup within the triangle may meet and some around it; of very
/// many a few stand for all. 0 only where no lookup there gives anything else.
double mean_around(const Texture& texture, const std::array<Vec2, 3>& triangle);

/// What the texture holds at `uv`: one texel, or four mixed, after they were made linear. Where a coordinate isn't
/// finite it counts as 0. Decodes the image when it is the first to ask. Safe from any thread.
Rgba look_up(const Texture& texture, Vec2 uv);

}  // namespace tessera
