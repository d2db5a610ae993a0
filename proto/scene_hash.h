#pragma once

#include <map>
#include <optional>
#include <string>
#include <unordered_map>

#include "proto/import/import.h"
#include "proto/json_cursor.h"
#include "proto/wire/sha256.h"

namespace tessera::proto {

/// What a file reference comes to: the contents that made the shapes, or the map, wherever they lay.
struct FileIdentity {
  ContentHash content;
  std::optional<FileFormat> format;               ///< None for an environment's map, which says itself what it is.
  std::map<std::string, ContentHash> companions;  ///< Those that the file asked for and got.
};

/// By the object of the document that names the file.
using FileIdentities = std::unordered_map<JsonDocument::Index, const FileIdentity*>;

/// SHA-256 of a canonical dump of a valid scene document: no white space, members sorted by key, numbers by value
/// (3, 3.0 and 3e0 are one), file references by identity. Documents of one hash make the same core Scene.
ContentHash scene_hash(const JsonCursor& scene, const FileIdentities& files);

/// The same document as JSON, with files that it names by path named by their content, as blobs with their companions:
/// it has the same hash. Of a file that asks for companions by names that aren't UTF-8, which no document can have, the
/// path stays.
std::string document_by_content(const JsonCursor& scene, const FileIdentities& files);

}  // namespace tessera::proto
