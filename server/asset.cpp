#include "server/asset.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "proto/wire/file_kind.h"
#include "server/blob_store.h"
#include "server/config.h"
#include "server/json_members.h"
#include "server/lane.h"
#include "server/media_type.h"

namespace tessera::server {
using proto::FileFormat;
using proto::FileKind;
using proto::Problem;
using proto::ProblemCode;
using proto::Result;

namespace {

struct MediaType {
  std::string_view name;
  FileFormat format;
};
constexpr MediaType kMediaTypes[] = {
    {"model/obj", FileFormat::obj},         {"model/ply", FileFormat::ply}, {"application/ply", FileFormat::ply},
    {"application/x-ply", FileFormat::ply}, {"text/nff", FileFormat::nff},  {"text/x-nff", FileFormat::nff},
};

struct KindOfFormat {
  FileKind kind;
  FileFormat format;
};
constexpr KindOfFormat kKinds[] = {
    {FileKind::obj, FileFormat::obj}, {FileKind::ply, FileFormat::ply}, {FileKind::nff, FileFormat::nff}};

constexpr std::string_view kBody = "body";

std::optional<FileFormat> format_of_type(std::string_view content_type) {
  for (const MediaType& type : kMediaTypes)
    if (is_media_type(content_type, type.name)) return type.format;
  return std::nullopt;
}

std::optional<FileFormat> format_of_kind(FileKind kind) {
  const auto* const found = std::ranges::find(kKinds, kind, &KindOfFormat::kind);
  return found == std::end(kKinds) ? std::nullopt : std::optional(found->format);
}

Problem cannot_tell(FileKind kind) {
  std::string types;
  for (const MediaType& type : kMediaTypes) types += std::string(type.name) + ", ";
  return {ProblemCode::unsupported_media_type,
          "This is " + std::string(description(kind)) + ". Send a model or a scene; where its content doesn't tell " +
              "what it is, Content-Type does: " + types + "application/json.",
          {}};
}

Result<Asset> open_document(Asset asset, ReceivedFile& file, const Config& config) {
  if (file.size() > config.max_body)
    return Problem{ProblemCode::payload_too_large,
                   "Of a document, at most " + std::to_string(config.max_body) + " bytes are taken.",
                   {}};
  FileBudget::spend(file.size());
  asset.document = file.content();
  asset.kind = has_member(asset.document, "scene") ? AssetKind::job_document : AssetKind::scene_document;
  return asset;
}

}  // namespace

proto::ContentHash RequestFiles::add(std::shared_ptr<ReceivedFile> file) {
  const proto::ContentHash hash = file->finish();
  files_.emplace(hash, std::move(file));
  return hash;
}

Result<proto::SourceFile> RequestFiles::blob(const proto::ContentHash& hash) const {
  const auto found = files_.find(hash);
  if (found == files_.end()) return others_.blob(hash);
  FileBudget::spend(found->second->size());
  return proto::SourceFile{found->second->path(), hash};
}

Result<proto::SourceFile> RequestFiles::asset(std::string_view relative_path, const std::stop_token& stop) const {
  return others_.asset(relative_path, stop);
}

Result<Asset> open_asset(Services& services, Request& request) {
  Asset asset;
  asset.name = kBody;
  asset.files = std::make_unique<RequestFiles>(services.blobs);
  ReceivedFile& file = *request.file;
  asset.hash = asset.files->add(request.file);
  if (file.size() == 0)
    return Problem{ProblemCode::malformed_request, "There is no body; send the file that is to be rendered.", {}};
  const std::string_view content_type = request.header("content-type").value_or("");
  if (const auto format = format_of_type(content_type)) {
    asset.format = *format;
    return asset;
  }
  const FileKind kind = proto::file_kind(file.head(proto::kFileHead), file.size());
  if (const auto format = format_of_kind(kind)) {
    asset.format = *format;
    return asset;
  }
  if (kind == FileKind::json || is_media_type(content_type, "application/json"))
    return open_document(std::move(asset), file, services.config);
  return cannot_tell(kind);
}

}  // namespace tessera::server
