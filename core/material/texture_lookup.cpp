#include "core/material/texture_lookup.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/math/srgb.h"

namespace tessera {
namespace {

/// Of all the numbers that texels of this type can be.
template <typename T>
const std::vector<float>& linear_table() {
  static const std::vector<float> table = [] {
    constexpr std::size_t kLargest = static_cast<T>(-1);
    std::vector<float> values(kLargest + 1);
    for (std::size_t i = 0; i <= kLargest; ++i)
      values[i] = light_of_encoded(static_cast<double>(i) / static_cast<double>(kLargest));
    return values;
  }();
  return table;
}

template <typename T>
float value_of(T number, bool is_srgb) {
  if constexpr (std::is_same_v<T, float>) {
    return is_srgb ? light_of_encoded(number) : number;
  } else {
    if (is_srgb) return linear_table<T>()[number];
    return static_cast<float>(number) / static_cast<float>(static_cast<T>(-1));
  }
}

/// The row or column that lies at `i`, whatever it is.
std::uint32_t wrapped(double i, std::uint32_t size, Wrap wrap) {
  const double n = size;
  switch (wrap) {
    case Wrap::clamp:
      return i < 0 ? 0 : i >= n ? size - 1 : static_cast<std::uint32_t>(i);
    case Wrap::repeat:
      return static_cast<std::uint32_t>(i - std::floor(i / n) * n);
    case Wrap::mirror: {
      const double within = i - std::floor(i / (2 * n)) * (2 * n);
      return static_cast<std::uint32_t>(within < n ? within : 2 * n - 1 - within);
    }
  }
  return 0;
}

/// Beyond this texels aren't told apart, and a whole number of images is left away from either side of a fraction.
constexpr double kFarthest = 0x1p20;

double finite(double v) { return std::abs(v) < kFarthest ? v : 0; }

/// In texels from the upper left corner. In double, where the position of a texel's centre and the products of floats
/// are exact.
struct Place {
  double u, v;
};
Place place_of(const Texture& texture, const Texels& texels, Vec2 uv) {
  const auto& m = texture.transform;
  return {finite(double{m[0]} * uv.x + double{m[1]} * uv.y + m[2]) * texels.width,
          finite(double{m[3]} * uv.x + double{m[4]} * uv.y + m[5]) * texels.height};
}

Rgba mixed(const Rgba& a, const Rgba& b, float share) {
  Rgba out;
  for (std::size_t i = 0; i < 4; ++i) out[i] = a[i] + (b[i] - a[i]) * share;
  return out;
}

}  // namespace

Rgba texel(const Texels& texels, bool is_srgb, std::uint32_t x, std::uint32_t y) {
  return std::visit(
      [&](const auto& values) -> Rgba {
        const auto* at = &values[(std::size_t{y} * texels.width + x) * texels.channels];
        const bool has_color = texels.channels > 2;
        const float first = value_of(at[0], is_srgb);
        const float alpha = texels.channels % 2 == 0 ? value_of(at[texels.channels - 1], false) : 1;
        if (!has_color) return {first, first, first, alpha};
        return {first, value_of(at[1], is_srgb), value_of(at[2], is_srgb), alpha};
      },
      texels.values);
}

double mean_around(const Texture& texture, const std::array<Vec2, 3>& triangle) {
  constexpr double kMostEachWay = 16;
  const Texels& texels = texture.image->texels();
  Place lo{kFarthest, kFarthest}, hi{-kFarthest, -kFarthest};
  for (const Vec2 corner : triangle) {
    const Place at = place_of(texture, texels, corner);
    lo = {std::min(lo.u, at.u), std::min(lo.v, at.v)};
    hi = {std::max(hi.u, at.u), std::max(hi.v, at.v)};
  }
  // One more on each side is for mixing, and for what lies in the triangle but for rounding.
  lo = {std::floor(lo.u) - 1, std::floor(lo.v) - 1};
  hi = {std::floor(hi.u) + 1, std::floor(hi.v) + 1};
  const double step_u = std::max(1.0, std::ceil((hi.u - lo.u) / kMostEachWay)),
               step_v = std::max(1.0, std::ceil((hi.v - lo.v) / kMostEachWay));
  double sum = 0, count = 0;
  for (double y = lo.v; y <= hi.v; y += step_v)
    for (double x = lo.u; x <= hi.u; x += step_u) {
      const Rgba color = texel(texels, texture.is_srgb, wrapped(x, texels.width, texture.wrap_u),
                               wrapped(y, texels.height, texture.wrap_v));
      sum += (double{color[0]} + color[1] + color[2]) / 3;
      ++count;
    }
  // What was passed over may shine, too.
  const bool is_all = step_u == 1 && step_v == 1;
  return std::max(sum / count, is_all ? 0 : 1e-3);
}

Rgba look_up(const Texture& texture, Vec2 uv) {
  const Texels& texels = texture.image->texels();
  const auto [u, v] = place_of(texture, texels, uv);
  const auto at = [&](double x, double y) {
    return texel(texels, texture.is_srgb, wrapped(x, texels.width, texture.wrap_u),
                 wrapped(y, texels.height, texture.wrap_v));
  };
  if (texture.is_nearest) return at(std::floor(u), std::floor(v));
  const double x = std::floor(u - 0.5), y = std::floor(v - 0.5);
  const auto right = static_cast<float>(u - 0.5 - x), down = static_cast<float>(v - 0.5 - y);
  return mixed(mixed(at(x, y), at(x + 1, y), right), mixed(at(x, y + 1), at(x + 1, y + 1), right), down);
}

}  // namespace tessera
