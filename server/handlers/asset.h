#pragma once

#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>

#include "proto/file_source.h"
#include "proto/import/import.h"
#include "server/handlers/own.h"
#include "server/http/request.h"
#include "server/services.h"
#include "server/store/blob_store.h"
#include "server/store/received_file.h"

namespace tessera::server {

/// The files of a request, as blobs: there for as long as the request is, so that nothing of them has to be written to
/// the disk for good, nor copied. What they aren't is looked for among those on the server.
class RequestFiles : public proto::FileSource {
 public:
  explicit RequestFiles(OwnFiles others) : others_(std::move(others)) {}

  /// Gives the file's hash.
  proto::ContentHash add(std::shared_ptr<ReceivedFile> file);

  /// Has all of them outlive the request, as long as what it returns lives. Throws as `BlobStore::capture` does.
  proto::Result<std::vector<proto::SourceFile>> keep_all(const BlobStore& blobs, const std::stop_token& stop) const;

  proto::Result<proto::SourceFile> blob(const proto::ContentHash& hash, const std::stop_token& stop) const override;
  proto::Result<proto::SourceFile> asset(std::string_view relative_path, const std::stop_token& stop) const override;
  const proto::AssetReader& reader() const override { return others_.reader(); }

 private:
  const OwnFiles others_;
  std::map<proto::ContentHash, std::shared_ptr<ReceivedFile>> files_;
};

enum class AssetKind { model, scene_document, job_document };

/// What the body of a request has to be rendered.
struct Asset {
  AssetKind kind = AssetKind::model;
  proto::FileFormat format = proto::FileFormat::obj;  ///< Of a model.
  std::string name;                                   ///< As messages call it.
  proto::ContentHash hash;
  std::map<std::string, proto::ContentHash> companions;  ///< Of a model: the other files, by their paths from it.
  std::string_view document;                             ///< As long as `files` are there.
  std::unique_ptr<RequestFiles> files;
};

/// Finds out what a request's body is: by its Content-Type where that says it, and by its content otherwise. Refusals:
/// `unsupported_media_type` for what isn't rendered, `payload_too_large` for a document that is.
proto::Result<Asset> open_asset(Services& services, Request& request);

}  // namespace tessera::server
