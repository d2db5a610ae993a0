#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/import/gltf/file.h"
#include "proto/import/gltf/glb.h"
#include "proto/import/gltf/meshopt.h"

namespace tessera::proto {

/// What a buffer view may be used for: one thing alone.
enum class ViewUse { none, vertices, indices, other };

/// A part of a buffer. Its range lies in the buffer.
struct BufferView {
  JsonCursor where;
  std::uint32_t buffer = 0;
  std::uint64_t offset = 0, length = 0;
  std::optional<std::uint32_t> stride = std::nullopt;
  ViewUse use = ViewUse::none;
  std::optional<MeshoptView> compressed = std::nullopt;  ///< In place of the buffer's bytes.
  std::string decoded = {};                              ///< Of a compressed view that has been asked for.
};

/// The bytes that a glTF document refers to: its buffers, from the GLB itself, from `data:` URIs, or beside the file,
/// and the views of them.
class GltfBuffers {
 public:
  /// Reads all buffers and checks all views. The bytes that `parts` views must outlive this.
  GltfBuffers(GltfFile& file, const GltfParts& parts);

  std::size_t views() const { return views_.size(); }
  const BufferView& view(std::uint32_t i) const { return views_[i]; }

  /// The view's bytes, as many as it says. Nothing, with an error at `where`, where its buffer comes without data or
  /// they can't be decoded.
  std::optional<std::string_view> bytes(std::uint32_t view, const JsonCursor& where);

  /// Whether the view's buffer comes with data, as it should where nobody brings it by other means.
  bool has_bytes(std::uint32_t view) const;

  /// Says what `where` uses a view for; an error, and false, where others use it, or mean it, for something else.
  bool use(std::uint32_t view, ViewUse use, const JsonCursor& where);

 private:
  struct Buffer {
    std::uint64_t length = 0;
    std::optional<std::string_view> bytes;  ///< At least as many; nothing for one that comes without data.
  };

  void read_buffer(const GltfObject& buffer, const GltfParts& parts);
  std::shared_ptr<const std::string> read_uri(const JsonCursor& uri);
  void read_view(const GltfObject& object);
  void read_stride(const GltfObject& object, BufferView& view);
  bool read_range(const GltfObject& object, std::uint32_t& buffer, std::uint64_t& offset, std::uint64_t& length);

  GltfFile& file_;
  std::vector<Buffer> buffers_;
  std::vector<std::shared_ptr<const std::string>> owned_;  ///< Of buffers that aren't the GLB's.
  std::vector<BufferView> views_;
};

}  // namespace tessera::proto
