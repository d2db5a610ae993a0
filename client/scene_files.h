#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "proto/wire/sha256.h"

namespace tessera::client {

/// A file here that a document names, and what it holds.
struct LocalFile {
  std::filesystem::path path;
  proto::ContentHash hash;

  bool operator==(const LocalFile&) const = default;
};

/// What `name_files_by_content` found.
struct NamedFiles {
  std::vector<LocalFile> to_upload;         ///< Each path once.
  std::vector<std::string> left_to_server;  ///< Paths that lead to nothing here; the server's asset root may have them.
};

/// Rewrites each {"type": "file", "path": ...} anywhere in `document` whose path, taken from `folder`, leads to a
/// file here: "blob", "format" and, for an OBJ's material libraries, "companions" take the path's place. The
/// document then means the same to a server that has these files as blobs. Paths that lead nowhere, and those whose
/// format can't be told, are left as they are. Throws `Failure` (local_file) when a file is there but can't be read.
NamedFiles name_files_by_content(nlohmann::json& document, const std::filesystem::path& folder);

/// "obj", "ply" or "nff" by the ending of a name, in any case; empty when it is none of these.
std::string scene_file_format(const std::filesystem::path& path);

}  // namespace tessera::client
