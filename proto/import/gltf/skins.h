#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "proto/import/gltf/nodes.h"

namespace tessera::proto {

/// What moves the vertices of a mesh: nodes, and the map from the mesh's space to each one's.
struct GltfSkin {
  std::vector<std::uint32_t> joints;
  std::optional<std::uint32_t> inverse_bind_matrices;  ///< An accessor; without one, nothing but the joints' own maps.
};

/// Checks all skins. Nodes are checked against their number: `nodes` of them there are.
std::vector<GltfSkin> read_skins(GltfFile& file, const Accessors& accessors, std::size_t nodes);

/// The maps from the mesh's space to the world, by joint. Empty, with a note at `where`, where a joint isn't in the
/// scene.
std::vector<Rows> joint_maps(const GltfSkin& skin, const GltfNodes& nodes, Accessors& accessors, GltfFile& file,
                             const JsonCursor& where);

}  // namespace tessera::proto
