#include "core/film/film.h"

#include <algorithm>
#include <utility>

namespace tessera {

Film::Film(std::uint32_t width, std::uint32_t height, const std::set<Aov>& aovs, std::vector<PixelRect> tiles)
    : pixels_({0, 0, static_cast<std::int32_t>(width), static_cast<std::int32_t>(height)}, aovs),
      tiles_(std::move(tiles)),
      tile_done_(std::make_unique<std::atomic<bool>[]>(tiles_.size())) {}

void Film::store(std::size_t index, const Pixels& tile) {
  pixels_.copy(tile, tile.rect);
  tile_done_[index].store(true, std::memory_order_release);
  stored_.fetch_add(1, std::memory_order_acq_rel);
}

std::vector<bool> Film::stored() const {
  std::vector<bool> stored(tiles_.size());
  for (std::size_t i = 0; i < tiles_.size(); ++i) stored[i] = tile_done_[i].load(std::memory_order_acquire);
  return stored;
}

std::vector<std::uint8_t> Film::pixels_of(const std::vector<bool>& stored) const {
  std::vector<std::uint8_t> pixels(pixels_.color.size());
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    if (!stored[i]) continue;
    const PixelRect rect = tiles_[i];
    for (std::int32_t y = rect.y0; y < rect.y1; ++y)
      std::fill_n(pixels.begin() + static_cast<std::ptrdiff_t>(pixels_.index(rect.x0, y)), rect.width(),
                  std::uint8_t{1});
  }
  return pixels;
}

std::uint64_t Film::memory_bytes(std::uint64_t width, std::uint64_t height, const std::set<Aov>& aovs) {
  return width * height * Pixels::bytes_per_pixel(aovs);
}

}  // namespace tessera
