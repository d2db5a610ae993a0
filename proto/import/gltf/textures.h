#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/scene/texture.h"
#include "proto/import/gltf/buffers.h"
#include "proto/wire/file_kind.h"

namespace tessera::proto {

/// A material's reference to a texture: which, and how it lies on the surface.
struct TextureInfo {
  std::uint32_t texture = 0;
  std::uint8_t uv_set = 0;
  std::array<float, 6> transform{1, 0, 0, 0, 1, 0};

  auto operator<=>(const TextureInfo&) const = default;
};

/// The textures of a document. Images are opened when a material that is seen asks for them.
class GltfTextures {
 public:
  /// Checks all textures, images and samplers. An image's texels may take `most_bytes`.
  GltfTextures(GltfFile& file, GltfBuffers& buffers, std::uint64_t most_bytes);

  /// Reads a material's reference; nothing where it is missing, or of a set of coordinates that isn't read.
  std::optional<TextureInfo> read_info(const std::optional<GltfObject>& object);

  /// The position in `take`'s list; nothing, with a note, where the image can't be had.
  std::optional<std::uint32_t> use(const TextureInfo& info, bool is_srgb);

  std::vector<Texture> take() { return std::move(out_); }

 private:
  struct Sampler {
    Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
    bool is_nearest = false;
  };
  struct Image {
    JsonCursor where;
    std::optional<JsonCursor> uri;
    std::optional<std::uint32_t> view = {};
    std::string_view media_type = {};
    bool is_opened = false;
    std::shared_ptr<const TextureImage> opened = {};  ///< Null where that failed.
  };
  /// What the bytes of an image are.
  struct Content {
    FileKind kind{};
    std::shared_ptr<const TextureImage> image;  ///< Null where they can't be used.
    std::string problem;                        ///< Why not.
  };
  struct Source {
    JsonCursor where;
    std::optional<std::uint32_t> image;
    Sampler sampler;
  };

  Sampler read_sampler(const GltfObject& object);
  Image read_image(const GltfObject& object);
  Source read_texture(const GltfObject& object);
  void read_transform(const GltfObject& object, TextureInfo& info, std::uint32_t& set);
  std::shared_ptr<const TextureImage> open(Image& image);
  Content content_of(const Image& image);
  static Content unusable(std::string why);
  Content read_content(std::string_view bytes) const;

  GltfFile& file_;
  GltfBuffers& buffers_;
  std::uint64_t most_bytes_;
  std::vector<Sampler> samplers_;
  std::vector<Image> images_;
  std::map<std::filesystem::path, Content> in_files_;                  ///< Of images that have been opened,
  std::map<std::pair<const char*, std::size_t>, Content> in_buffers_;  ///< each once, however many name its bytes.
  std::vector<Source> textures_;
  std::vector<Texture> out_;
  std::map<std::pair<TextureInfo, bool>, std::uint32_t> used_;
};

}  // namespace tessera::proto
