#pragma once

#include <algorithm>
#include <cstdint>

namespace tessera {

/// Pixels [x0, x1) × [y0, y1), y downwards from the image's top row. Empty when x0 ≥ x1 or y0 ≥ y1.
struct PixelRect {
  std::int32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  constexpr bool operator==(const PixelRect&) const = default;
  constexpr bool empty() const { return x0 >= x1 || y0 >= y1; }
  constexpr std::int32_t width() const { return x1 - x0; }
  constexpr std::int32_t height() const { return y1 - y0; }
  constexpr std::int64_t area() const { return empty() ? 0 : std::int64_t{width()} * height(); }
};

constexpr PixelRect intersect(PixelRect a, PixelRect b) {
  return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}
constexpr bool overlap(PixelRect a, PixelRect b) { return !intersect(a, b).empty(); }

}  // namespace tessera
