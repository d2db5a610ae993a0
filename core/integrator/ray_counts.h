#pragma once

#include <cstdint>

namespace tessera {

/// Rays traced, by kind, and first-level rays that were not.
struct RayCounts {
  std::uint64_t camera = 0;
  std::uint64_t camera_hits = 0;
  std::uint64_t reflection = 0;
  std::uint64_t refraction = 0;
  std::uint64_t shadow = 0;
  std::uint64_t scattered = 0;       ///< Of paths, from surfaces on.
  std::uint64_t camera_skipped = 0;  ///< Samples in tiles that nothing projects into.

  std::uint64_t traced() const { return camera + reflection + refraction + shadow + scattered; }
  bool operator==(const RayCounts&) const = default;
  RayCounts& operator+=(const RayCounts& other) {
    camera += other.camera;
    camera_hits += other.camera_hits;
    reflection += other.reflection;
    refraction += other.refraction;
    shadow += other.shadow;
    scattered += other.scattered;
    camera_skipped += other.camera_skipped;
    return *this;
  }
};

}  // namespace tessera
