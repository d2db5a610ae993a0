#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/sha256.h"

namespace tessera::server {

/// How a scene's document lies on disk. Its file is named for the scene's hash, which only parsing tells; so that its
/// bytes can be checked, it begins with a line that has the hash of all that follows. The next line names the blobs
/// that the document needs, and then comes the document.
struct SceneFile {
  std::vector<proto::ContentHash> blobs;
  std::string document;
};

constexpr const char* kSceneExtension = ".scene";

/// What stands before the document.
std::string scene_file_head(const std::vector<proto::ContentHash>& blobs, std::string_view document);

/// Nothing when there is none, or it hasn't these lines; whether it is whole isn't looked at. Throws StorageErrors.
std::optional<SceneFile> read_scene_file(const std::filesystem::path& path);
/// The two lines alone.
struct SceneFileHead {
  proto::ContentHash hash;  ///< Of what follows the first.
  std::vector<proto::ContentHash> blobs;
};
std::optional<SceneFileHead> read_scene_file_head(const std::filesystem::path& path);

/// Whether all that follows the first line has the hash that this says (`Shelf::IsWhole`).
bool is_whole_scene_file(int file, const std::string& name, const std::stop_token& stop);

/// Every content hash that a document names in any of its strings, once.
std::vector<proto::ContentHash> hashes_named_in(std::string_view document);

}  // namespace tessera::server
