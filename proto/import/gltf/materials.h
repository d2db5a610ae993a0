#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/scene/material.h"
#include "proto/import/gltf/meshes.h"
#include "proto/import/gltf/textures.h"

namespace tessera::proto {

/// The materials of a document. Those that are seen are made, with their textures, when they are asked for.
class GltfMaterials {
 public:
  /// Checks all materials.
  GltfMaterials(GltfFile& file, GltfTextures& textures);

  UsedUvs used_uvs() const;

  /// The position in `take`'s list of a material, or of glTF's default material, for a mesh with or without colours.
  std::uint32_t use(std::optional<std::uint32_t> material, bool has_colors);

  std::vector<Material> take() { return std::move(out_); }

 private:
  struct Use {
    TextureUse use;
    TextureInfo info;
    bool is_srgb;
  };
  struct Source {
    Material material;
    std::vector<Use> textures;
    bool has_alpha = false;             ///< Otherwise it is opaque, whatever its colours say.
    std::optional<std::uint32_t> used;  ///< Position in the list.
  };

  class Reader;

  GltfTextures& textures_;
  std::vector<Source> materials_;
  Source default_;
  std::vector<Material> out_;
};

}  // namespace tessera::proto
