#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "proto/import/gltf/accessors.h"

namespace tessera::proto {

/// An affine map: row-major 3x4, local to world.
using Rows = std::array<double, 12>;
inline constexpr Rows kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// `b` first.
Rows operator*(const Rows& a, const Rows& b);

Vec3d transform_point(const Rows& m, Vec3d p);
Vec3d transform_vector(const Rows& m, Vec3d v);

/// Of its linear part.
double determinant(const Rows& m);

/// How many things of each kind nodes may name.
struct NodeReferences {
  std::size_t meshes = 0, cameras = 0, lights = 0, skins = 0;
};

struct GltfNode {
  JsonCursor where;
  Rows to_parent = kIdentity;
  std::optional<std::uint32_t> mesh = {}, camera = {}, light = {}, skin = {};
  std::vector<std::uint32_t> children = {};
  std::optional<std::uint32_t> parent = {};
  std::size_t weights = 0;            ///< The number of them.
  std::vector<Rows> instances = {};   ///< EXT_mesh_gpu_instancing; empty without.
  std::optional<Rows> to_world = {};  ///< Of a node that is in the scene.
};

struct GltfNodes {
  std::vector<GltfNode> nodes;
  std::vector<std::uint32_t> in_scene;  ///< Parents before their children, brothers in order.
};

/// Checks all nodes and scenes, and walks through the scene that is asked for, by default the file's own default; or,
/// where the file has no scenes, through all nodes.
GltfNodes read_nodes(GltfFile& file, Accessors& accessors, const NodeReferences& references,
                     std::optional<std::uint32_t> scene);

}  // namespace tessera::proto
