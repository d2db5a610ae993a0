#include "core/film/film.h"

#include <algorithm>
#include <utility>

namespace tessera {
namespace {

/// Copies the pixels of `rect` of one plane; both pixel sets must cover it.
template <typename T>
void copy_plane(const Pixels& from, std::vector<T> Pixels::*plane, PixelRect rect, Pixels& to) {
  const std::vector<T>& source = from.*plane;
  if (source.empty()) return;
  for (std::int32_t y = rect.y0; y < rect.y1; ++y)
    std::copy_n(source.begin() + static_cast<std::ptrdiff_t>(from.index(rect.x0, y)), rect.width(),
                (to.*plane).begin() + static_cast<std::ptrdiff_t>(to.index(rect.x0, y)));
}

void copy_rect(const Pixels& from, PixelRect rect, Pixels& to) {
  copy_plane(from, &Pixels::color, rect, to);
  copy_plane(from, &Pixels::depth, rect, to);
  copy_plane(from, &Pixels::normal, rect, to);
  copy_plane(from, &Pixels::primitive_id, rect, to);
  copy_plane(from, &Pixels::object_id, rect, to);
  copy_plane(from, &Pixels::cost_volumes, rect, to);
  copy_plane(from, &Pixels::cost_primitives, rect, to);
}

}  // namespace

Pixels::Pixels(PixelRect where, const std::set<Aov>& aovs) : rect(where) {
  const auto count = static_cast<std::size_t>(where.area());
  color.resize(count);
  if (aovs.contains(Aov::depth)) depth.assign(count, kInfinity);
  if (aovs.contains(Aov::normal)) normal.resize(count);
  if (aovs.contains(Aov::primitive_id)) primitive_id.assign(count, kNoId);
  if (aovs.contains(Aov::object_id)) object_id.assign(count, kNoId);
  if (aovs.contains(Aov::cost_volumes)) cost_volumes.resize(count);
  if (aovs.contains(Aov::cost_primitives)) cost_primitives.resize(count);
}

Film::Film(std::uint32_t width, std::uint32_t height, const std::set<Aov>& aovs, std::vector<PixelRect> tiles)
    : pixels_({0, 0, static_cast<std::int32_t>(width), static_cast<std::int32_t>(height)}, aovs),
      tiles_(std::move(tiles)),
      tile_done_(std::make_unique<std::atomic<bool>[]>(tiles_.size())) {}

void Film::store(std::size_t index, const Pixels& tile) {
  copy_rect(tile, tile.rect, pixels_);
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
  std::uint64_t per_pixel = sizeof(Rgb);
  for (const Aov aov : aovs) per_pixel += aov == Aov::normal ? sizeof(Vec3) : sizeof(float);
  return width * height * per_pixel;
}

}  // namespace tessera
