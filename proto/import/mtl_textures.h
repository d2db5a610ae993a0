#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "core/scene/material.h"
#include "proto/import/import.h"
#include "proto/import/import_notes.h"
#include "proto/import/texture_files.h"
#include "proto/wire/material_textures.h"

namespace tessera::proto {

/// What a statement of an MTL library says of a texture.
struct MtlMap {
  TextureSlot slot{};
  std::string name;  ///< Of the image,
  InputFile file;    ///< which is there.
  std::array<float, 2> scale{1, 1}, offset{0, 0};
  bool is_clamped = false;
  std::optional<bool> is_srgb;          ///< Where it is said.
  std::optional<std::uint8_t> channel;  ///< Where it is said.
  float height = 1;                     ///< Of bumps, and of normals along the surface.
  std::size_t line = 0;
};

/// The textures that the MTL libraries of one OBJ file name.
class MtlTextures {
 public:
  MtlTextures(const CompanionSource& companions, std::uint64_t most_bytes, std::stop_token stop);

  /// Reads a statement of `kTextureKeywords`, in lower case. Nothing, with a note, where there is no such image.
  std::optional<MtlMap> read(std::string_view library, std::string_view keyword, std::string_view arguments,
                             ImportNotes& notes, std::size_t line);

  /// The use of a map by a material that is seen; nothing, with a note, where its image can't be used.
  std::optional<TextureUse> use(const MtlMap& map, ImportNotes& notes);

  /// What `use` speaks of.
  std::vector<Texture> take() { return std::move(textures_); }

 private:
  using Key = std::tuple<const TextureImage*, bool, bool, std::array<float, 6>>;

  TextureSearch search_;
  std::map<std::string, InputFile> found_;
  std::set<std::string, std::less<>> missing_;  ///< The first ones.
  TextureFiles files_;
  std::vector<Texture> textures_;
  std::map<Key, std::uint32_t> known_;
};

}  // namespace tessera::proto
