#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <set>
#include <variant>
#include <vector>

#include "core/bounds/pixel_rect.h"
#include "core/film/aov_table.h"

namespace tessera {

/// Values of a plane, pixel by pixel; of the type of its row's `empty`.
using PlaneValues = std::variant<std::vector<float>, std::vector<std::uint32_t>, std::vector<Rgb>, std::vector<Vec3>>;

/// The pixels of a rectangle, row by row from its top: colour, and the AOVs that are recorded.
struct Pixels {
  PixelRect rect;
  std::vector<Rgb> color;  ///< Linear radiance, the mean of the pixel's samples.

  /// All values are those of nothing.
  Pixels(PixelRect where, const std::set<Aov>& recorded);

  std::size_t index(std::int32_t x, std::int32_t y) const {
    return static_cast<std::size_t>(y - rect.y0) * rect.width() + (x - rect.x0);
  }

  /// Which AOVs are recorded. `plane` and `values` of the others are empty.
  const std::set<Aov>& aovs() const { return aovs_; }
  bool has(Aov aov) const { return aovs_.contains(aov); }
  const PlaneValues& values(Aov aov) const { return planes_[static_cast<std::size_t>(aov)]; }

  /// Precondition: T is the type of the plane's values.
  template <typename T>
  std::vector<T>& plane(Aov aov) {
    return std::get<std::vector<T>>(planes_[static_cast<std::size_t>(aov)]);
  }
  template <typename T>
  const std::vector<T>& plane(Aov aov) const {
    return std::get<std::vector<T>>(values(aov));
  }

  /// Sets a pixel's value, if the AOV is recorded. Precondition as above.
  template <typename T>
  void record(Aov aov, std::size_t pixel, const T& value) {
    if (std::vector<T>& values = plane<T>(aov); !values.empty()) values[pixel] = value;
  }

  /// Takes the pixels of `where` from others that have them, and all planes of these.
  void copy(const Pixels& from, PixelRect where);

  /// Bytes of all values of a pixel.
  static std::uint64_t bytes_per_pixel(const std::set<Aov>& recorded);

 private:
  std::set<Aov> aovs_;
  std::array<PlaneValues, kAovCount> planes_;
};

/// Copies a rectangle of one image, row by row, into another one. Both cover it.
template <typename T>
void copy_rect(const std::vector<T>& from, PixelRect from_rect, PixelRect where, std::vector<T>& to,
               PixelRect to_rect) {
  const auto at = [](PixelRect rect, std::int32_t x, std::int32_t y) {
    return (std::ptrdiff_t{y} - rect.y0) * rect.width() + (x - rect.x0);
  };
  for (std::int32_t y = where.y0; y < where.y1; ++y)
    std::copy_n(from.begin() + at(from_rect, where.x0, y), where.width(), to.begin() + at(to_rect, where.x0, y));
}

}  // namespace tessera
