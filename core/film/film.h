#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <vector>

#include "core/bounds/pixel_rect.h"
#include "core/math/rgb.h"
#include "core/math/rounding.h"
#include "core/math/vec.h"
#include "core/scene/settings.h"

namespace tessera {

/// `primitive_id` and `object_id` where a pixel's first sample hits nothing.
inline constexpr std::uint32_t kNoId = 0xFFFFFFFF;

/// The pixels of a rectangle, row by row from its top. A plane that wasn't asked for is empty.
struct Pixels {
  PixelRect rect;
  std::vector<Rgb> color;    ///< Linear radiance, the mean of the pixel's samples.
  std::vector<float> depth;  ///< Metres along the camera's axis; infinite for the background.
  std::vector<Vec3> normal;  ///< World space, unit, shading normal; zero for the background.
  std::vector<std::uint32_t> primitive_id;
  std::vector<std::uint32_t> object_id;
  std::vector<float> cost_volumes;     ///< Tests of volumes for the pixel, the mean of its samples; 0 where none.
  std::vector<float> cost_primitives;  ///< Likewise of primitives.

  Pixels(PixelRect where, const std::set<Aov>& aovs);
  std::size_t index(std::int32_t x, std::int32_t y) const {
    return static_cast<std::size_t>(y - rect.y0) * rect.width() + (x - rect.x0);
  }
};

/// A job's image while and after it is rendered. Tiles own disjoint pixels, so `store` takes no lock: different
/// tiles may be stored at once, and read while others are being stored.
class Film {
 public:
  Film(std::uint32_t width, std::uint32_t height, const std::set<Aov>& aovs, std::vector<PixelRect> tiles);

  /// Copies in the pixels of tile `index`. Once for each tile.
  void store(std::size_t index, const Pixels& tile);

  std::size_t tile_count() const { return tiles_.size(); }
  std::size_t tiles_stored() const { return stored_.load(std::memory_order_acquire); }
  bool complete() const { return tiles_stored() == tile_count(); }

  /// Which tiles are stored by now, and how it looks by pixels: a byte for each, 1 where its tile is among `stored`.
  std::vector<bool> stored() const;
  std::vector<std::uint8_t> pixels_of(const std::vector<bool>& stored) const;

  /// The image, without a copy. Pixels of tiles that aren't stored must not be read.
  const Pixels& pixels() const { return pixels_; }

  /// Bytes of a film of that size, before making it.
  static std::uint64_t memory_bytes(std::uint64_t width, std::uint64_t height, const std::set<Aov>& aovs);

 private:
  Pixels pixels_;
  std::vector<PixelRect> tiles_;
  std::unique_ptr<std::atomic<bool>[]> tile_done_;
  std::atomic<std::size_t> stored_{0};
};

}  // namespace tessera
