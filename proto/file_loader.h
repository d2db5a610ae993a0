#pragma once

#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "proto/scene_builder.h"
#include "proto/scene_hash.h"

namespace tessera::proto {

/// The file that an object of the document names, found but not read yet.
struct FileReference {
  JsonCursor where;
  std::string name;  ///< The path, or the blob's hash.
  SourceFile file;
  FileFormat format;
  ImportOptions options;
  std::optional<std::map<std::string, SourceFile>> companions;  ///< Given with a blob; a path has its siblings.
};

/// Thrown for what keeps files from being read, and is answered as it is.
struct NoFaultOfTheDocument {
  Problem problem;
};

/// A file whose shapes and materials are in the scene.
struct LoadedFile {
  FileIdentity identity;
  std::vector<ScenePart> parts;
  std::vector<Light> lights;
  std::optional<Rgb> background;
  std::vector<NamedCamera> cameras;
  std::optional<ImageSize> image;
};

/// Brings files into a scene, each once however often the document names it.
class FileLoader {
 public:
  FileLoader(const FileSource& files, SceneBuilder& builder, std::stop_token stop)
      : files_(files), builder_(builder), stop_(std::move(stop)) {}

  /// Reads the fields of a file object and finds the file; nothing, with errors, when that fails.
  std::optional<FileReference> find(JsonFields& fields) const;

  /// Reads the fields that name an environment's map, and the map itself, into `map`. Whether they name one; it stays
  /// null, with errors, when it can't be had.
  bool find_environment(JsonFields& fields, std::shared_ptr<const EnvironmentMap>& map);

  /// Imports the file into the scene, or gives what an earlier call made of it. Nothing when it is broken or goes
  /// beyond a limit: the errors are said on the first call. Lives as long as the loader.
  const LoadedFile* load(const FileReference& reference);

  /// Of all files that are in the scene. Lives as long as the loader.
  const FileIdentities& identities() const { return identities_; }

  /// Those among them that lie under the asset root, by their content.
  std::vector<SourceFile> assets() const;

 private:
  std::optional<LoadedFile> import(const FileReference& reference);

  const FileSource& files_;
  SceneBuilder& builder_;
  const std::stop_token stop_;
  std::map<std::string, std::optional<LoadedFile>> loaded_;
  std::deque<FileIdentity> environments_;  // whose places don't move
  FileIdentities identities_;
  std::map<ContentHash, std::filesystem::path> assets_;
};

}  // namespace tessera::proto
