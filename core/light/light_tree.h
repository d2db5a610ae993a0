#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/light/light_bounds.h"
#include "core/math/vec.h"

namespace tessera {

/// Lights under a binary hierarchy, of which one is picked about in proportion to what it may send to a point: Conty
/// Estevez & Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018, without the splitting.
/// No light is left out that may send anything. Immutable, safe from any thread; 72 bytes a light.
class LightTree {
 public:
  /// Lights without intensity are never picked. O(n log n). At most 2^29 lights.
  explicit LightTree(std::span<const LightBounds> lights);

  /// How many lights may be picked.
  std::uint32_t size() const { return size_; }

  /// Of the heap that it takes.
  std::size_t bytes() const { return nodes_.capacity() * sizeof(Node) + ways_.capacity() * sizeof(std::uint64_t); }

  struct Picked {
    std::uint32_t light;  ///< Its place among those that the tree was made of.
    double probability;
    double rest;  ///< Where `pick` fell within what is that light's, in [0, 1): evenly distributed again.
  };
  /// The light that `pick`, in [0, 1), falls on. `normal` is unit where only light from its side counts, and zero
  /// otherwise. Precondition: there is a light to pick.
  Picked pick(Vec3d point, Vec3 normal, double pick) const;

  /// About what they all send to the point: the irradiance (W/m²) on a surface with that normal, or on one that faces
  /// each of them where it is zero. 0 only where nothing is sent. Precondition: there is a light to pick.
  double irradiance(Vec3d point, Vec3 normal) const;

  /// That `pick` gives that light. The probabilities of all lights add up to 1.
  double probability(std::uint32_t light, Vec3d point, Vec3 normal) const;

 private:
  /// Bounds as they are kept, rounded so that they hold no less.
  struct Branch {
    Vec3 center;
    std::uint16_t half_size[3];  ///< Of the box: the upper halves of floats.
    std::int8_t cos_spread, cos_reach;
    std::uint32_t axis;  ///< Three times ten bits.
    float intensity;     ///< 2^100 for all lights together.
    std::uint32_t link;  ///< See light_tree.cpp.
  };
  /// Two branches fill a line of the cache.
  struct alignas(64) Node {
    Branch branches[2];
  };
  class Builder;

  static double importance(const Branch& branch, Vec3d point, Vec3d normal);
  /// How likely the way down goes on in either branch.
  struct Shares {
    double of[2];
  };
  static Shares shares(const Node& node, Vec3d point, Vec3d normal);

  std::vector<Node> nodes_;  ///< The root is the first.
  /// For each light the way to it, a bit a level from the lowest on, closed by a 1; 0 when it is never picked.
  std::vector<std::uint64_t> ways_;
  std::uint32_t size_ = 0;
  std::uint32_t only_ = 0;  ///< The light where one is all there is: the first branch of the root.
  double unit_ = 0;         ///< Of branches' intensities, W/sr.
};

}  // namespace tessera
