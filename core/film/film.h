#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <set>
#include <vector>

#include "core/bounds/pixel_rect.h"
#include "core/film/pixels.h"

namespace tessera {

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
