#include "core/render/sample_order.h"

#include <algorithm>

namespace tessera {
namespace {

/// Bits 0, 2, 4 and 6 of a place along the curve.
std::int32_t every_other_bit(std::uint32_t along) {
  return static_cast<std::int32_t>((along & 1) | (along >> 1 & 2) | (along >> 2 & 4) | (along >> 3 & 8));
}

}  // namespace

SampleOrder::SampleOrder(PixelRect rect, const Pass& pass)
    : rect_(rect),
      pass_(pass),
      columns_((rect.width() + kSquare - 1) / kSquare),
      end_(kPlaces * static_cast<std::uint64_t>(columns_) *
           static_cast<std::uint64_t>((rect.height() + kSquare - 1) / kSquare)) {
  go_to(0);
}

void SampleOrder::go_to(std::uint64_t place) {
  place_ = place;
  done_ = 0;
  square_ = square(place);
}

PixelRect SampleOrder::square(std::uint64_t place) const {
  const auto number = static_cast<std::int64_t>(place / kPlaces);
  const std::int32_t x0 = rect_.x0 + static_cast<std::int32_t>(number % columns_) * kSquare;
  const std::int32_t y0 = rect_.y0 + static_cast<std::int32_t>(number / columns_) * kSquare;
  return {x0, y0, std::min(x0 + kSquare, rect_.x1), std::min(y0 + kSquare, rect_.y1)};
}

bool SampleOrder::next(std::size_t most_samples, std::size_t most_pixels, std::vector<SampleId>& out) {
  out.clear();
  for (std::size_t pixels = 0; pixels < most_pixels && place_ < end_;) {
    const auto along = static_cast<std::uint32_t>(place_ % kPlaces);
    const std::int32_t x = square_.x0 + every_other_bit(along), y = square_.y0 + every_other_bit(along >> 1);
    if (x < square_.x1 && y < square_.y1) {
      const SampleRange& samples = pass_.of(x, y);
      for (; done_ < samples.count; ++done_) {
        if (out.size() == most_samples) return true;
        out.push_back({x, y, samples.first + done_});
      }
      if (samples.count > 0) ++pixels;
    }
    done_ = 0;
    if (++place_ % kPlaces == 0) square_ = square(place_);
  }
  return !out.empty();
}

std::uint64_t SampleOrder::samples_at(std::uint64_t place) const {
  const PixelRect at = square(place);
  const auto along = static_cast<std::uint32_t>(place % kPlaces);
  const std::int32_t x = at.x0 + every_other_bit(along), y = at.y0 + every_other_bit(along >> 1);
  return x < at.x1 && y < at.y1 ? pass_.of(x, y).count : 0;
}

std::optional<SampleOrder> SampleOrder::split(std::uint64_t least_samples) {
  // Back from the end, by whole squares as far as there are some, until half of what is left lies behind.
  const auto step_before = [&](std::uint64_t place) {
    return place % kPlaces == 0 && place > place_ + kPlaces ? kPlaces : 1;
  };
  const auto samples_before = [&](std::uint64_t place, std::uint64_t step) {
    return step == kPlaces ? pass_.samples_in(square(place - step)) : samples_at(place - step);
  };
  std::uint64_t all = 0;
  for (std::uint64_t place = end_; place > place_;) {
    const std::uint64_t step = step_before(place);
    all += samples_before(place, step);
    place -= step;
  }
  std::uint64_t given = 0, from = end_;
  while (from > place_ + 1) {
    std::uint64_t step = step_before(from), more = samples_before(from, step);
    if (given + more > all / 2 && step > 1) more = samples_before(from, step = 1);
    if (given + more > all / 2) break;
    given += more;
    from -= step;
  }
  if (given < least_samples || given == 0) return std::nullopt;
  SampleOrder rest = *this;
  rest.go_to(from);
  end_ = from;
  return rest;
}

}  // namespace tessera
