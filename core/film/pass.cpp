#include "core/film/pass.h"

namespace tessera {

Pass::Pass(std::uint32_t image_width, std::uint32_t image_height, SampleRange samples)
    : width(static_cast<std::int32_t>(image_width)),
      height(static_cast<std::int32_t>(image_height)),
      blocks(static_cast<std::size_t>(columns()) * static_cast<std::size_t>(rows()), samples) {}

PixelRect Pass::rect_of(std::size_t block) const {
  const auto across = static_cast<std::size_t>(columns());
  const std::int32_t x = static_cast<std::int32_t>(block % across) * kBlock;
  const std::int32_t y = static_cast<std::int32_t>(block / across) * kBlock;
  return {x, y, std::min(x + kBlock, width), std::min(y + kBlock, height)};
}

std::uint64_t Pass::samples_in(PixelRect rect) const {
  std::uint64_t samples = 0;
  for_blocks_in(rect, [&](PixelRect part, const SampleRange& range) {
    samples += static_cast<std::uint64_t>(part.area()) * range.count;
  });
  return samples;
}

}  // namespace tessera
