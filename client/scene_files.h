#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "proto/wire/file_kind.h"
#include "proto/wire/sha256.h"

namespace tessera::client {

/// A file here that a document names, and what it holds.
struct LocalFile {
  std::filesystem::path path;
  proto::ContentHash hash;

  bool operator==(const LocalFile&) const = default;
};

/// Where a document's files may be.
struct SceneFolder {
  std::filesystem::path folder{};              ///< From which its paths are taken; the working folder when empty.
  std::vector<std::filesystem::path> named{};  ///< What the user named, who may name whatever can be read.
  bool allow_outside = false;                  ///< Whether files outside the folder may be sent.
};

/// What `name_files_by_content` found.
struct NamedFiles {
  std::vector<LocalFile> to_upload;         ///< Each path once.
  std::vector<std::string> left_to_server;  ///< Paths that lead to nothing here; the server's asset root may have them.
  std::vector<std::string> notes;           ///< What the user should know of these files.
};

/// Rewrites each {"type": "file", "path": ...} anywhere in `document` whose path, taken from the folder, leads to a
/// file here: "blob", "format" and, for a glTF file's buffers and images, an OBJ's material libraries and their
/// textures, and a PLY's texture, "companions" take the path's place; and each {"type": "environment", "path": ...},
/// whose map needs "blob" alone. The document then means the same to a server that has these files as blobs. A file's
/// format is what its content says, else what its name's ending does. Paths that lead nowhere are left as they are.
/// They are found in any case of letters.
///
/// Files outside the folder, by their path or by symbolic links, aren't sent unless that is allowed: a companion is
/// left out with a note. Throws `Failure` (local_file) when the document itself names such a file, one whose
/// format isn't known, or one that can't be read.
NamedFiles name_files_by_content(nlohmann::json& document, const SceneFolder& folder);

/// "gltf", "obj", "ply", "stl" or "nff" for such a file, by its kind, or for an unknown kind by the ending of its name,
/// in any case. Empty when it is none of these.
std::string scene_file_format(const std::filesystem::path& path, proto::FileKind kind);

}  // namespace tessera::client
