#include "core/film/film.h"

#include <algorithm>
#include <utility>

namespace tessera {

Film::Film(std::uint32_t width, std::uint32_t height, const std::set<Aov>& aovs, std::vector<PixelRect> tiles)
    : pixels_({0, 0, static_cast<std::int32_t>(width), static_cast<std::int32_t>(height)}, aovs),
      tiles_(std::move(tiles)),
      versions_(tiles_.size()) {}

void Film::store(std::size_t index, const Pixels& tile) {
  const std::lock_guard lock(lock_of(index));
  pixels_.copy(tile, tile.rect);
  ++versions_[index];
}

std::vector<std::uint32_t> Film::versions() const {
  std::vector<std::uint32_t> versions(tiles_.size());
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    const std::lock_guard lock(lock_of(i));
    versions[i] = versions_[i];
  }
  return versions;
}

Film::Snapshot Film::snapshot(const std::set<Aov>& aovs) const {
  Snapshot out{Pixels(pixels_.rect, aovs), std::vector<std::uint32_t>(tiles_.size()),
               std::vector<std::uint8_t>(pixels_.color.size())};
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    const PixelRect rect = tiles_[i];
    {
      const std::lock_guard lock(lock_of(i));
      out.versions[i] = versions_[i];
      if (out.versions[i] == 0) continue;
      out.pixels.copy(pixels_, rect);
    }
    for (std::int32_t y = rect.y0; y < rect.y1; ++y)
      std::fill_n(out.is_there.begin() + static_cast<std::ptrdiff_t>(pixels_.index(rect.x0, y)), rect.width(),
                  std::uint8_t{1});
  }
  return out;
}

std::uint64_t Film::memory_bytes(std::uint64_t width, std::uint64_t height, const std::set<Aov>& aovs) {
  return width * height * Pixels::bytes_per_pixel(aovs);
}

}  // namespace tessera
