#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>

#include "proto/file_source.h"
#include "server/store/received_file.h"
#include "server/store/shelf.h"

namespace tessera::server {

/// `invalid_document`, as one says of a blob that isn't there.
proto::Problem no_such_blob(const proto::ContentHash& hash);

/// Uploaded files by the hash of their content, and the files of the asset root: where scenes find what they
/// name. A blob is checked against its hash before it is used first. Safe to call from any number of threads. What the
/// disk refuses is a StorageError.
class BlobStore : public proto::FileSource {
 public:
  /// Keeps blobs in `folder`, which exists; damaged ones go to `set_aside`. Throws std::system_error when `asset_root`
  /// is given and can't be found.
  BlobStore(std::filesystem::path folder, std::filesystem::path set_aside,
            const std::optional<std::filesystem::path>& asset_root, const proto::AssetReader& reader);

  /// An empty file to receive a blob in.
  std::unique_ptr<ReceivedFile> receive() const;

  enum class Put { created, known };
  /// Keeps a received file as `hash`, or refuses with `hash_mismatch`. Throws `Abandoned` once that is requested, and
  /// the blob may have been kept.
  proto::Result<Put> put(const proto::ContentHash& hash, ReceivedFile& file, const std::stop_token& abandoned = {});

  /// Keeps a file that lies elsewhere as a blob, too, and holds that; the problem, when it isn't any more what it was.
  /// Throws as `put` does.
  proto::Result<proto::SourceFile> capture(const proto::SourceFile& file, const std::stop_token& abandoned) const;

  /// Throws `Abandoned` when it is stopped.
  proto::Result<proto::SourceFile> blob(const proto::ContentHash& hash,
                                        const std::stop_token& stop = {}) const override;
  proto::Result<proto::SourceFile> asset(std::string_view relative_path,
                                         const std::stop_token& stop = {}) const override;
  const proto::AssetReader& reader() const override { return reader_; }

  /// The files, by the digits of their hashes.
  Shelf& shelf() { return shelf_; }

 private:
  const std::filesystem::path folder_;
  mutable Shelf shelf_;               ///< It keeps in mind what has been looked at.
  std::filesystem::path asset_root_;  ///< Canonical; empty for none.
  const proto::AssetReader& reader_;
};

/// What a hash is in a name of a file.
inline std::string hash_digits(const proto::ContentHash& hash) { return hash.substr(hash.find(':') + 1); }

}  // namespace tessera::server
