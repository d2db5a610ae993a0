#pragma once

#include <optional>
#include <string_view>

namespace tessera::proto {

/// The parts of a glTF file: its JSON text, and the binary chunk of a GLB, if it has one. Views of the file's bytes.
struct GltfParts {
  std::string_view json;
  std::optional<std::string_view> binary;
  bool is_glb = false;
};

/// Takes a file apart: a GLB (glTF 2.0, "GLB File Format Specification") by its signature, JSON text otherwise. Chunks
/// of other types are passed over. Throws `BrokenFile`, with the byte where a chunk lies.
GltfParts take_apart(std::string_view bytes, std::string_view file_name);

}  // namespace tessera::proto
