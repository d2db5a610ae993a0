#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <variant>

#include "core/math/rgb.h"
#include "core/math/vec.h"
#include "core/scene/settings.h"

namespace tessera {

/// `primitive_id` and `object_id` where a pixel's first sample hits nothing.
inline constexpr std::uint32_t kNoId = 0xFFFFFFFF;

/// A pixel's value in a plane.
using PlaneValue = std::variant<float, std::uint32_t, Rgb, Vec3>;

/// How a pixel's value comes about.
enum class AovOrigin {
  first_sample,  ///< Of the pixel's first sample alone.
  mean,          ///< Over all samples of the pixel; those that say nothing count as zero.
  derived,       ///< From the film's own sums and counts.
};

/// How a plane is shown in 8 bits.
enum class AovLook {
  color,      ///< As colour is: sRGB's curve.
  linear,     ///< 0 is black and 1 white, without any curve.
  nearness,   ///< From the nearest finite value, white, to the farthest, dark grey; infinite is black.
  direction,  ///< −1..1 as 0..255.
  extent,     ///< Each channel from the least to the greatest finite value of the image.
  hue,        ///< A colour of its own for each value.
  heat,       ///< `heat_color` from 0 to the greatest value of the image; of several channels, their mean.
};

/// One row for every plane that a film may record beside colour: what there is to be known of it, but for who fills it
/// (core/render). A new AOV is an enumerator and a row.
struct AovEntry {
  Aov aov;
  std::string_view name;                     ///< On the wire.
  PlaneValue empty;                          ///< Where nothing is seen, or nothing is yet; of the plane's type.
  std::array<std::string_view, 3> channels;  ///< In EXR; the others of a value with fewer of them are empty.
  AovOrigin origin;
  AovLook look;
};

/// In the order of Aov.
std::span<const AovEntry> aov_table();
const AovEntry& aov_entry(Aov aov);

inline constexpr std::size_t kAovCount = static_cast<std::size_t>(Aov::base_color) + 1;

}  // namespace tessera
