#pragma once

#include <cstdint>

#include "core/accel/test_counts.h"

namespace tessera {

/// Counts what a trace tests. The structures take it as a template argument, so that `NoTally` costs nothing.
class Tally {
 public:
  static constexpr bool kCounts = true;

  explicit Tally(TestCounts& counts) : counts_(counts) {}

  void volume(bool hit) const {
    ++counts_.volume_tests;
    counts_.volume_hits += hit;
  }
  void volumes(std::uint64_t tests, std::uint64_t hits) const {
    counts_.volume_tests += tests;
    counts_.volume_hits += hits;
  }
  void object(bool hit) const {
    ++counts_.object_tests;
    counts_.object_hits += hit;
  }
  /// A leaf or group has been looked into: it was a false hit if nothing was hit since `hits()` was `before`.
  void looked_into(std::uint64_t before) const { counts_.false_hits += counts_.object_hits == before; }
  std::uint64_t hits() const { return counts_.object_hits; }

 private:
  TestCounts& counts_;
};

/// The same face, nothing counted.
struct NoTally {
  static constexpr bool kCounts = false;

  void volume(bool) const {}
  void volumes(std::uint64_t, std::uint64_t) const {}
  void object(bool) const {}
  void looked_into(std::uint64_t) const {}
  std::uint64_t hits() const { return 0; }
};

}  // namespace tessera
