#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>

#include "core/accel/wide/wide_tree.h"
#include "core/geometry/triangle_mesh.h"

namespace tessera::server {

/// What tells a mesh's hierarchy from all others: 64 hex digits, the hash of its positions and triangles, of how it is
/// built and of its layout.
std::string wide_key(const TriangleMesh& mesh);

/// Bytes of the file that a hierarchy takes.
std::uint64_t wide_file_bytes(const WideTree& tree);

/// Writes a hierarchy to `path`, all of it or nothing, to outlive a power cut. Throws std::system_error.
void write_wide_file(const std::filesystem::path& path, const std::string& key, const WideTree& tree);

/// A file isn't what was written; why not.
class DamagedFile : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A hierarchy, read from its file, whatever becomes of that afterwards. Nothing if there is no such file; throws
/// DamagedFile if it isn't exactly what `write_wide_file` wrote for that key on a machine like this one, and
/// std::system_error if it can't be read.
std::optional<WideTree> read_wide_file(const std::filesystem::path& path, const std::string& key);

}  // namespace tessera::server
