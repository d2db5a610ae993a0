#include "core/render/sample_order.h"

namespace tessera {
namespace {

/// Bits 0, 2, 4 and 6 of a place along the curve.
std::int32_t every_other_bit(std::uint32_t along) {
  return static_cast<std::int32_t>((along & 1) | (along >> 1 & 2) | (along >> 2 & 4) | (along >> 3 & 8));
}

}  // namespace

bool SampleOrder::next(std::size_t most_samples, std::size_t most_pixels, std::vector<SampleId>& out) {
  out.clear();
  for (std::size_t pixels = 0; pixels < most_pixels && y0_ < rect_.y1;) {
    const std::int32_t x = x0_ + every_other_bit(along_), y = y0_ + every_other_bit(along_ >> 1);
    if (x < rect_.x1 && y < rect_.y1) {
      const SampleRange& samples = pass_.of(x, y);
      for (; done_ < samples.count; ++done_) {
        if (out.size() == most_samples) return true;
        out.push_back({x, y, samples.first + done_});
      }
      if (samples.count > 0) ++pixels;
    }
    next_pixel();
  }
  return !out.empty();
}

void SampleOrder::next_pixel() {
  done_ = 0;
  if (++along_ < kSquare * kSquare) return;
  along_ = 0;
  x0_ += kSquare;
  if (x0_ < rect_.x1) return;
  x0_ = rect_.x0;
  y0_ += kSquare;
}

}  // namespace tessera
