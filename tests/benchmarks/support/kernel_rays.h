#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/accel/accel.h"
#include "tests/benchmarks/support/kernel_scenes.h"

namespace tessera::bench {

/// How rays are handed to a structure: which of its batched calls suits them.
enum class Query { closest_fan, occluded_fan, closest, occluded };

constexpr bool is_any_hit(Query query) { return query == Query::occluded_fan || query == Query::occluded; }

/// Rays of one kind, cut into the batches in which they are handed over.
struct RaySet {
  std::string name;
  Query query = Query::closest;
  Vec3 apex;  ///< Of an `occluded_fan`.
  std::vector<Ray> rays;
  Directions directions;          ///< Of the rays of a `closest_fan`.
  std::vector<std::size_t> ends;  ///< Of the batches; each begins where the one before it ends.

  /// Rays [begin, end) of the half of the batches that one of two threads traces.
  struct Range {
    std::size_t begin, end;
  };
  Range half(int which) const;

  /// Calls `visit(begin, end)` for every batch of a half.
  template <typename Visit>
  void each_batch(int which, Visit&& visit) const {
    const Range range = half(which);
    std::size_t begin = range.begin;
    for (const std::size_t end : ends) {
      if (end <= range.begin) continue;
      if (end > range.end) break;
      visit(begin, end);
      begin = end;
    }
  }
};

inline constexpr std::array<std::string_view, 5> kKernelRays = {"first_level", "shadow", "ao", "diffuse", "random"};

/// A tile of first-level rays: 32 × 32 pixels, 4 × 4 blocks one after another.
inline constexpr std::uint32_t kTileSide = 32, kBlockSide = 4;
/// Rays in a batch that isn't a tile: of those that leave surfaces as many as a few tiles' pictures hold, and of random
/// ones as many as a stream holds. Renders trace 1024 samples together.
inline constexpr std::size_t kBatch = 4096, kRandomBatch = 32768;

/// One set for each of `kKernelRays`, of the picture of side × side pixels (a multiple of 64): a jittered ray for each
/// pixel; from what they hit, on the viewer's side, a ray to the light where the surface faces it, a short ray and a
/// long one distributed like the cosine to the normal; and half as many segments between points of the scene's box as
/// there are pixels. Every other row of tiles comes first, so that both halves of a set see all of the picture.
/// A short ray is as long as 7% of the box's diagonal.
std::vector<RaySet> kernel_rays(const KernelScene& scene, const Accel& accel, std::uint32_t side);

/// Every `stride`-th batch of the set.
RaySet part_of(const RaySet& set, std::size_t stride);

}  // namespace tessera::bench
