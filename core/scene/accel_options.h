#pragma once

#include <cstdint>
#include <vector>

#include "core/bounds/slab_presets.h"

namespace tessera {

/// Which acceleration structure a job asks for. `automatic` lets the plan pick.
enum class AccelKind { automatic, brute, bounds, bvh, grid, octree, kd, bsp, wide };

/// What encloses objects and the nodes of a hierarchy.
enum class BoundKind { box, sphere, slabs, hull };

/// Where an instance is enclosed: around its points in the world, or around its shape in the shape's own space, into
/// which the ray is taken first.
enum class BoundSpace { world, object };

/// How a structure is made. Each kind reads the options of its row in `accel_table()` and no other.
struct AccelOptions {
  AccelKind kind = AccelKind::automatic;
  BoundKind bound = BoundKind::box;
  BoundSpace space = BoundSpace::world;
  std::vector<Vec3> normals = slab_preset(7);  ///< Of the slabs: finite, not zero, of any length.
  std::uint32_t max_faces = 24;                ///< Of a convex hull that is clipped against.
  std::uint32_t group_size = 0;                ///< Items under one bound; 0: an object each, and √n of n triangles.
  std::uint32_t leaf_size = 8;                 ///< A leaf with more items is split where that is possible at all.
  std::uint32_t max_depth = 0;                 ///< 0: as deep as the number of items asks for.
  std::uint32_t cells_per_item = 4;            ///< Of a grid, empty cells included.

  bool operator==(const AccelOptions&) const = default;
};

}  // namespace tessera
