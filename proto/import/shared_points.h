#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/math/vec.h"

namespace tessera::proto {

/// Numbers points so that those in one place share a number; −0 is 0, and NaN is a place like others. A few points may
/// get a second number where very many places are much alike: sharing is for the sake of memory and looks alone.
class SharedPoints {
 public:
  /// The number of the point's place; new ones count up from 0.
  std::uint32_t number(Vec3 point);

  /// By their numbers.
  const std::vector<Vec3>& points() const { return points_; }
  std::vector<Vec3> take() { return std::move(points_); }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  /// Where the point's number stands, or may be put; null where neither can be.
  std::uint32_t* slot(Vec3 point);
  void grow();

  std::vector<Vec3> points_;
  std::vector<std::uint32_t> slots_;  ///< A table with open places, as long as a power of 2.
};

}  // namespace tessera::proto
