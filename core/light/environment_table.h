#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/math/vec2.h"
#include "core/scene/light.h"

namespace tessera {

/// An environment map that is looked up and sampled. Between the centres of its texels radiance is interpolated
/// bilinearly, around the seam too; beyond those of the first and last row it stays as it is.
///
/// The centres are the corners of cells. A direction is chosen by the cell, in proportion to solid angle times mean
/// radiance, and within it by the corners' radiances, interpolated as well, but over equal areas (the vertical is the
/// cosine). So density and radiance have about one ratio, and the density is 0 only where the radiance is. All
/// directions are the map's own. Immutable, safe from any thread; 4 bytes a texel.
class EnvironmentTable {
 public:
  /// Precondition: the map has texels.
  explicit EnvironmentTable(std::shared_ptr<const EnvironmentMap> map);

  /// Of the heap that it takes, the map left out; nothing of the studio's, which all scenes share.
  std::size_t bytes() const;

  /// Of all directions, and channels, W/(sr m²).
  double mean_radiance() const { return mean_radiance_; }

  /// A direction of length 1, for `u` in [0, 1)². Precondition: the mean radiance isn't 0.
  Vec3 sample(Vec2 u) const;

  struct Value {
    Rgb radiance;
    double pdf;  ///< Of `sample`, per solid angle; 0 all over for a black map.
  };
  /// `direction` has length 1.
  Value look_up(Vec3 direction) const;

 private:
  struct Corners;

  Corners corners(std::uint32_t column, std::uint32_t row) const;
  std::span<const std::uint32_t> shares(std::uint32_t row) const;

  std::shared_ptr<const EnvironmentMap> map_;
  std::vector<double> cosines_;         ///< Of the angles to +y at which rows of cells begin, and the last one ends.
  std::vector<std::uint32_t> rows_;     ///< Where each row's share of [0, 2^32) begins.
  std::vector<std::uint32_t> columns_;  ///< For each row, where each cell's share begins.
  double mean_radiance_ = 0;
};

/// The table of a map: the studio's is made once.
std::shared_ptr<const EnvironmentTable> environment_table(const std::shared_ptr<const EnvironmentMap>& map);

}  // namespace tessera
