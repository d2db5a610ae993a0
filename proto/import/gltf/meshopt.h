#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "proto/import/gltf/object.h"

namespace tessera::proto {

enum class MeshoptMode { attributes, triangles, indices };
enum class MeshoptFilter { none, octahedral, quaternion, exponential };

/// What EXT_meshopt_compression says of a buffer view.
struct MeshoptView {
  JsonCursor where;
  std::uint32_t buffer = 0;
  std::uint64_t offset = 0, length = 0;  ///< Of the encoded bytes.
  std::uint32_t stride = 0;
  std::uint64_t count = 0;
  MeshoptMode mode{};
  MeshoptFilter filter{};
};

/// Reads the extension of a view of `length` bytes, its range excepted. False, with errors, where it doesn't fit
/// together, or where so many encoded bytes can't hold so many elements.
bool read_meshopt(const GltfObject& extension, std::uint64_t length, std::optional<std::uint32_t> stride,
                  MeshoptView& out);

/// Decodes `encoded` into `count` elements. False, with the reason, where it is broken.
bool decode_meshopt(const MeshoptView& view, std::string_view encoded, std::string& out, std::string& why);

}  // namespace tessera::proto
