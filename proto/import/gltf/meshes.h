#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/import/gltf/accessors.h"

namespace tessera::proto {

/// How a primitive's indices make points, lines and triangles.
enum class Topology : std::uint32_t { points, lines, line_loop, line_strip, triangles, triangle_strip, triangle_fan };

/// KHR_draco_mesh_compression: the ids in the compressed mesh, by name, of those attributes that are read.
struct DracoPrimitive {
  JsonCursor where;
  std::uint32_t view = 0;
  std::map<std::string, std::uint32_t, std::less<>> ids;
};

/// A part of a mesh. Accessors are of types that glTF allows for what they are used for, and all attributes have as
/// many elements.
struct Primitive {
  JsonCursor where;
  Topology topology = Topology::triangles;
  std::optional<std::uint32_t> position = {}, normal = {}, tangent = {}, color = {}, joints = {}, weights = {},
                               indices = {};
  std::array<std::optional<std::uint32_t>, 2> uvs = {};
  std::optional<std::uint32_t> material = {};
  std::optional<DracoPrimitive> draco = {};

  bool is_surface() const { return topology >= Topology::triangles && position; }
};

struct GltfMesh {
  std::vector<Primitive> primitives;
  std::size_t targets = 0;  ///< Morph targets.
  bool has_weights = false;
  bool has_joints = false;
};

/// What meshes need to know of materials: by material, which sets of texture coordinates its textures look up.
using UsedUvs = std::vector<std::array<bool, 2>>;

/// Checks all meshes. `variant` is the position of the asked-for variant (KHR_materials_variants).
std::vector<GltfMesh> read_meshes(GltfFile& file, GltfBuffers& buffers, const Accessors& accessors,
                                  const UsedUvs& materials, std::optional<std::uint32_t> variant);

}  // namespace tessera::proto
