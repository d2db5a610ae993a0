#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string_view>

#include "proto/file_source.h"
#include "proto/parse.h"
#include "server/store/blob_references.h"
#include "server/store/blob_store.h"
#include "server/store/shelf.h"
#include "server/store/single_flight.h"

namespace tessera::server {

/// `not_found`, as one says of a scene that isn't there.
proto::Problem no_such_scene(const proto::ContentHash& hash);

/// Scenes by content hash: the documents on disk, checked before they are used first; what they parse to in memory, as
/// far as it fits. Safe to call from any number of threads. Parsing and reading the disk take their time: not for an
/// I/O thread. What the disk refuses is a StorageError.
class SceneStore {
 public:
  /// Keeps documents in `folder`, which exists, and up to `cache_bytes` of parsed scenes; damaged ones go to
  /// `set_aside`. Files that they name by path become blobs, so that a scene is there for good.
  SceneStore(std::filesystem::path folder, std::filesystem::path set_aside, const BlobStore& files,
             proto::Limits limits, std::uint64_t cache_bytes);

  struct Put {
    proto::ParsedScene scene;
    bool known;                        ///< It was there before.
    std::shared_ptr<const void> hold;  ///< It stays as long as this lives.
  };
  /// Parses a document, with blobs from `files`, and keeps it, or says what is wrong with it. Throws `Abandoned` once
  /// that is requested.
  proto::Result<Put> put(std::string_view document, const proto::FileSource& files, const std::stop_token& abandoned);

  /// Keeps the document that was parsed to this, in place of one that is damaged or written otherwise. Whether there
  /// was a whole one; the problem, when files that it names by path have changed since. The blobs that it names have to
  /// be there, and held. Throws as `put` does.
  proto::Result<bool> keep(const proto::ParsedScene& scene, std::string_view document,
                           const std::stop_token& abandoned);
  /// Whether a scene is kept, and whole. Throws as `put` does.
  bool is_kept(const proto::ContentHash& hash, const std::stop_token& abandoned);

  /// A scene that was put, now or by an earlier daemon, or that is in memory because it was shared. `not_found`
  /// when it is neither, or was damaged, `gone` when it has expired; `invalid_document` when files that it names have
  /// changed since or are gone. However many ask at once, it is parsed once, by one while the others wait. Throws
  /// `Abandoned` once that is requested.
  proto::Result<proto::ParsedScene> find(const proto::ContentHash& hash, const std::stop_token& abandoned);

  /// The scene of a document that names no file by path, with blobs from `files`. It isn't kept on disk, but as long as
  /// it is in memory, no document with this hash is parsed again, nor by two at once. Throws `Abandoned` once that is
  /// requested.
  proto::Result<proto::ParsedScene> parse_once(const proto::ContentHash& document_hash, std::string_view document,
                                               const proto::FileSource& files, const std::stop_token& abandoned);

  /// `Shelf::sweep`, and what is removed is forgotten.
  Shelf::Swept sweep(const Shelf::Limits& limits, const std::stop_token& stop);

  /// As long as this lives, a scene's document stays where it is there.
  std::shared_ptr<const void> hold(const proto::ContentHash& hash) { return shelf_.hold(hash_digits(hash)); }

  /// Forgets a scene, unless it is held or `is_needed` (`Shelf::remove`).
  Shelf::Removal remove(const proto::ContentHash& hash, const std::function<bool()>& is_needed);

  /// The copy in memory of a scene with this content: `scene` itself, unless there is one already. Holds its document,
  /// where there is one.
  proto::ParsedScene share(proto::ParsedScene scene);

  /// Whether a stored document names the blob.
  bool names_blob(const proto::ContentHash& blob) const { return references_.is_named(blob); }

  /// The documents, by the digits of their hashes.
  Shelf& shelf() { return shelf_; }
  /// Has scenes take so many bytes of memory at most for now, but for those in use.
  void shrink(std::uint64_t most) { scenes_.shrink(most); }
  /// What is in memory: scenes, and which scene a document has.
  CacheUsage scenes_usage() const { return scenes_.usage(); }
  CacheUsage documents_usage() const { return documents_.usage(); }

 private:
  /// A scene, or what is wrong with it, which isn't kept.
  using Found = proto::Result<std::shared_ptr<const Scene>>;
  using Scenes = SingleFlight<Found>;

  void adopt_older_files() const;
  void read_references();
  bool keep_document(const proto::ContentHash& hash, std::string_view document, const std::stop_token& abandoned);
  Found read(const proto::ContentHash& hash, const std::stop_token& unwanted);

  const std::filesystem::path folder_;
  const BlobStore& files_;
  const proto::Limits limits_;
  Shelf shelf_;
  BlobReferences references_;
  Scenes scenes_;
  SingleFlight<proto::Result<proto::ContentHash>> documents_;  ///< By their hashes, those of their scenes.
};

}  // namespace tessera::server
