#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/math/vec.h"

namespace tessera {

/// The numbers of directions for which there is a preset.
inline constexpr std::array kSlabPresets{3, 7, 9, 13};

/// The most normals that slabs may have: the planes of a polytope of 64 faces.
inline constexpr std::size_t kMostNormals = 32;

/// The normals of the classic k-DOPs (Klosowski et al. 1998): the 3 axes; with the 4 diagonals of a cube 7; with the 6
/// diagonals of its faces 9; with both 13. Not of unit length. Precondition: `count` is one of `kSlabPresets`.
std::vector<Vec3> slab_preset(int count);

}  // namespace tessera
