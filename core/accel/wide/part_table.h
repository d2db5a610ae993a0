#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

namespace tessera {

/// Of numbers that are parted into stretches, to which stretch one belongs: a look into a table, and mostly no more.
/// Stretches of no numbers belong to none.
class PartTable {
 public:
  PartTable() = default;
  /// Where stretches begin, ascending from 0, and where the last one ends.
  PartTable(std::span<const std::uint32_t> begins, std::uint32_t end) {
    if (end == 0) return;
    shift_ = std::max(0, static_cast<int>(std::bit_width(end) - std::bit_width(begins.size())));
    firsts_.reserve(((end - 1) >> shift_) + 1);
    std::uint32_t part = 0;
    for (std::uint32_t row = 0; row <= (end - 1) >> shift_; ++row) {
      while (part + 1 < begins.size() && begins[part + 1] <= row << shift_) ++part;
      firsts_.push_back(part);
    }
  }

  /// `begins` as before. Precondition: number < end.
  std::uint32_t part_of(std::uint32_t number, std::span<const std::uint32_t> begins) const {
    const std::size_t row = number >> shift_;
    const std::uint32_t first = firsts_[row];
    const std::size_t last = row + 1 < firsts_.size() ? firsts_[row + 1] : begins.size() - 1;
    const auto after =
        std::upper_bound(begins.begin() + first + 1, begins.begin() + static_cast<std::ptrdiff_t>(last) + 1, number);
    return static_cast<std::uint32_t>(after - begins.begin()) - 1;
  }

  std::size_t bytes() const { return firsts_.size() * sizeof(std::uint32_t); }

 private:
  std::vector<std::uint32_t> firsts_;  ///< The stretch of every 2^shift_-th number.
  int shift_ = 0;
};

}  // namespace tessera
