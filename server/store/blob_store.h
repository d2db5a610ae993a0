#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "proto/file_source.h"
#include "server/store/received_file.h"

namespace tessera::server {

/// `invalid_document`, as one says of a blob that isn't there.
proto::Problem no_such_blob(const proto::ContentHash& hash);

/// Uploaded files by the hash of their content, and the files of the asset root: where scenes find what they
/// name. Safe to call from any number of threads.
class BlobStore : public proto::FileSource {
 public:
  /// Keeps blobs in `folder`, which exists. Throws std::system_error when `asset_root` is given and can't be found.
  BlobStore(std::filesystem::path folder, const std::optional<std::filesystem::path>& asset_root);

  /// An empty file to receive a blob in.
  std::unique_ptr<ReceivedFile> receive() const;

  enum class Put { created, known };
  /// Keeps a received file as `hash`, or refuses with `hash_mismatch`.
  proto::Result<Put> put(const proto::ContentHash& hash, ReceivedFile& file);

  proto::Result<proto::SourceFile> blob(const proto::ContentHash& hash) const override;
  proto::Result<proto::SourceFile> asset(std::string_view relative_path,
                                         const std::stop_token& stop = {}) const override;

 private:
  std::filesystem::path folder_;
  std::filesystem::path asset_root_;  ///< Canonical; empty for none.
};

}  // namespace tessera::server
