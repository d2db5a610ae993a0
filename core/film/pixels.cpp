#include "core/film/pixels.h"

namespace tessera {

Pixels::Pixels(PixelRect where, const std::set<Aov>& recorded) : rect(where), aovs_(recorded) {
  const auto count = static_cast<std::size_t>(where.area());
  color.resize(count);
  for (const AovEntry& row : aov_table())
    std::visit(
        [&](auto empty) {
          planes_[static_cast<std::size_t>(row.aov)] =
              std::vector<decltype(empty)>(recorded.contains(row.aov) ? count : 0, empty);
        },
        row.empty);
}

void Pixels::copy(const Pixels& from, PixelRect where) {
  copy_rect(from.color, from.rect, where, color, rect);
  for (const Aov aov : aovs_)
    std::visit(
        [&]<typename T>(const std::vector<T>& values) { copy_rect(values, from.rect, where, plane<T>(aov), rect); },
        from.values(aov));
}

std::uint64_t Pixels::bytes_per_pixel(const std::set<Aov>& recorded) {
  std::uint64_t bytes = sizeof(Rgb);
  for (const Aov aov : recorded) bytes += std::visit([](auto empty) { return sizeof empty; }, aov_entry(aov).empty);
  return bytes;
}

}  // namespace tessera
