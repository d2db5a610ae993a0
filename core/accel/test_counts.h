#pragma once

#include <cstdint>

namespace tessera {

/// What tracing cost: the tightness of the volumes against their number.
struct TestCounts {
  std::uint64_t volume_tests = 0;  ///< Rays clipped against a bounding volume, or taken through a cell or a plane.
  std::uint64_t volume_hits = 0;   ///< Of those, the ones that had to be looked into.
  std::uint64_t object_tests = 0;  ///< Calls of a primitive's `intersect`, or hits that were sure without.
  std::uint64_t object_hits = 0;   ///< Of those, the ones that hit.
  std::uint64_t false_hits = 0;    ///< Leaves and groups that were looked into, and nothing in them was hit.

  bool operator==(const TestCounts&) const = default;
  TestCounts& operator+=(const TestCounts& other) {
    volume_tests += other.volume_tests;
    volume_hits += other.volume_hits;
    object_tests += other.object_tests;
    object_hits += other.object_hits;
    false_hits += other.false_hits;
    return *this;
  }
};

}  // namespace tessera
