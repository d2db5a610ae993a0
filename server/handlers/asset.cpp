#include "server/handlers/asset.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "proto/wire/file_kind.h"
#include "proto/wire/printable.h"
#include "server/config.h"
#include "server/handlers/json_members.h"
#include "server/handlers/zip_archive.h"
#include "server/http/lane.h"
#include "server/http/media_type.h"
#include "server/http/multipart.h"
#include "server/store/blob_store.h"

namespace tessera::server {
using proto::FileFormat;
using proto::FileKind;
using proto::Problem;
using proto::ProblemCode;
using proto::Result;

namespace {

/// By a format's name, as a media type or a kind may be known of which the importers don't read any yet.
template <typename Sign>
struct SignOf {
  Sign sign;
  std::string_view format;
};
constexpr SignOf<std::string_view> kMediaTypes[] = {
    {"model/gltf-binary", "gltf"}, {"model/gltf+json", "gltf"}, {"model/obj", "obj"}, {"model/stl", "stl"},
    {"application/sla", "stl"},    {"application/ply", "ply"},  {"model/ply", "ply"}, {"application/x-ply", "ply"},
    {"text/nff", "nff"},           {"text/x-nff", "nff"},
};
constexpr SignOf<FileKind> kKinds[] = {
    {FileKind::obj, "obj"},  {FileKind::ply, "ply"},       {FileKind::nff, "nff"},       {FileKind::gltf, "gltf"},
    {FileKind::glb, "gltf"}, {FileKind::stl_ascii, "stl"}, {FileKind::stl_binary, "stl"}};

/// Fields of a form that are files even without a name: what they hold says what they are.
constexpr std::string_view kFileFields[] = {"scene", "file", "asset"};

std::optional<FileFormat> format_called(std::string_view name) {
  const auto formats = proto::file_format_names();
  const auto found = std::ranges::find(formats, name, &proto::Choice<FileFormat>::name);
  return found == formats.end() ? std::nullopt : std::optional(found->value);
}

std::optional<FileFormat> format_of_type(std::string_view content_type) {
  for (const auto& [name, format] : kMediaTypes)
    if (is_media_type(content_type, name)) return format_called(format);
  return std::nullopt;
}

std::optional<FileFormat> format_of_kind(FileKind kind) {
  const auto* const found = std::ranges::find(kKinds, kind, &SignOf<FileKind>::sign);
  return found == std::end(kKinds) ? std::nullopt : format_called(found->format);
}

Problem cannot_tell(FileKind kind) {
  std::string types;
  for (const auto& [name, format] : kMediaTypes)
    if (format_called(format)) types += std::string(name) + ", ";
  return {ProblemCode::unsupported_media_type,
          "This is " + std::string(description(kind)) + ". Send a model or a scene; where its content doesn't tell " +
              "what it is, Content-Type does: " + types + "application/json.",
          {}};
}

bool is_zip(std::string_view content_type, FileKind kind) {
  return kind == FileKind::zip || is_media_type(content_type, "application/zip") ||
         is_media_type(content_type, "application/x-zip-compressed");
}

Problem unusable(std::string detail) { return {ProblemCode::malformed_request, std::move(detail), {}}; }

/// The format that a file has by what is said of it.
std::optional<FileFormat> format_of(const NamedFile& file) {
  const auto by_type = format_of_type(file.content_type);
  return by_type ? by_type : proto::format_of(file.name);
}

/// A media type of that format.
std::string type_of(FileFormat format) {
  const auto name = name_of(proto::file_format_names(), format);
  return std::string(std::ranges::find(kMediaTypes, name, &SignOf<std::string_view>::format)->sign);
}

/// Names of files, as they are written in a sentence.
std::string listed(const std::vector<const NamedFile*>& files) {
  constexpr std::size_t kMostNames = 10;
  std::string text;
  for (std::size_t i = 0; i < std::min(files.size(), kMostNames); ++i)
    text += (i == 0 ? "" : ", ") + proto::printable(files[i]->name);
  return files.size() > kMostNames ? text + " and " + std::to_string(files.size() - kMostNames) + " more" : text;
}

class AssetOpener {
 public:
  AssetOpener(Services& services, const Principal& who, const std::stop_token& abandoned)
      : services_(services), abandoned_(abandoned) {
    asset_.files = std::make_unique<RequestFiles>(OwnFiles(services, who));
  }

  Result<Asset> open_form(std::string_view content_type, ReceivedFile& body) {
    FileBudget::spend(body.size());
    const auto parts = parse_form(content_type, body.content());
    if (!parts) return parts.problem();
    std::vector<NamedFile> files;
    std::set<std::string> names;
    MemoryOfFiles memory;
    for (const FormPart& part : *parts) {
      const std::string& given = part.file_name ? *part.file_name : part.name;
      const std::string called = '"' + proto::printable(given) + '"';
      if (!part.file_name && std::ranges::find(kFileFields, part.name) == std::end(kFileFields))
        return unusable("The form's part " + called + " is no file: it has no file name.");
      std::string name = with_slashes(given);
      if (const std::string why = why_unsafe(name); !why.empty())
        return unusable("The form's file " + called + ' ' + why);
      name = std::filesystem::path(name).lexically_normal().generic_string();
      if (!names.insert(name).second) return unusable("Two of the form's files are called " + called + '.');
      NamedFile& file = files.emplace_back(NamedFile{std::move(name), part.content_type, services_.blobs.receive()});
      file.file->write(std::as_bytes(std::span(part.content)));
      memory.settle(*file.file);
      if (!part.file_name && !format_of_type(part.content_type))
        if (const auto format = format_of_kind(proto::file_kind(file.file->head(proto::kFileHead), file.file->size())))
          file.content_type = type_of(*format);
    }
    if (files.size() == 1) return open_one(files.front());
    return open_all(files);
  }

  Result<Asset> open_one(const NamedFile& given) {
    ReceivedFile& file = *given.file;
    if (file.size() == 0) return unusable("There is nothing in the body; send the file that is to be rendered.");
    const FileKind kind = proto::file_kind(file.head(proto::kFileHead), file.size());
    if (is_zip(given.content_type, kind)) return open_archive(file);
    auto format = format_of_type(given.content_type);
    if (!format) format = format_of_kind(kind);
    if (format) return take_model(given, *format);
    if (kind == FileKind::json || is_media_type(given.content_type, "application/json")) return take_document(given);
    return cannot_tell(kind);
  }

 private:
  Result<Asset> open_archive(ReceivedFile& archive) {
    FileBudget::spend(archive.size());
    if (FileBudget::is_limited()) throw TooHeavy{};
    const auto new_file = [this] { return std::shared_ptr<ReceivedFile>(services_.blobs.receive()); };
    const auto files = unpack_zip(archive.content(), services_.config.max_blob, new_file, abandoned_);
    if (!files) return files.problem();
    return open_all(*files);
  }

  /// One of them is the model, the others go with it.
  Result<Asset> open_all(const std::vector<NamedFile>& files) {
    std::vector<const NamedFile*> all, models;
    for (const NamedFile& file : files) {
      all.push_back(&file);
      if (format_of(file)) models.push_back(&file);
    }
    if (models.size() > 1)
      return unusable("It can't be told which file is to be rendered: " + listed(models) +
                      ". Send one of them, with the files that it names.");
    if (models.empty())
      return unusable(files.empty() ? "There is no file in it."
                                    : "None of the files is known to be a model by its name: " + listed(all) + '.');
    const NamedFile& model = *models.front();
    const auto folder = std::filesystem::path(model.name).parent_path();
    for (const NamedFile& file : files)
      if (&file != &model)
        asset_.companions.emplace(std::filesystem::path(file.name).lexically_relative(folder).generic_string(),
                                  asset_.files->add(file.file));
    return take_model(model, *format_of(model));
  }

  Asset take_model(const NamedFile& file, FileFormat format) {
    asset_.format = format;
    asset_.name = proto::printable(file.name);
    asset_.hash = asset_.files->add(file.file);
    return std::move(asset_);
  }

  Result<Asset> take_document(const NamedFile& file) {
    const std::uint64_t most = services_.config.max_body;
    if (file.file->size() > most)
      return Problem{
          ProblemCode::payload_too_large, "Of a document, at most " + std::to_string(most) + " bytes are taken.", {}};
    FileBudget::spend(file.file->size());
    const std::string_view document = file.file->content();
    const bool is_job = has_member(document, "scene");
    // A glTF file whose beginning doesn't tell.
    const auto gltf = format_called("gltf");
    if (gltf && !is_job && has_member(document, "asset")) return take_model(file, *gltf);
    Asset asset = take_model(file, {});
    asset.document = document;
    asset.kind = is_job ? AssetKind::job_document : AssetKind::scene_document;
    return asset;
  }

  Services& services_;
  const std::stop_token& abandoned_;
  Asset asset_;
};

}  // namespace

proto::ContentHash RequestFiles::add(std::shared_ptr<ReceivedFile> file) {
  const proto::ContentHash hash = file->finish();
  files_.emplace(hash, std::move(file));
  return hash;
}

Result<std::vector<proto::SourceFile>> RequestFiles::keep_all(const BlobStore& blobs,
                                                              const std::stop_token& stop) const {
  std::vector<proto::SourceFile> kept;
  for (const auto& [hash, file] : files_) {
    auto blob = blobs.capture({file->path(), hash}, stop);
    if (!blob) return blob.problem();
    kept.push_back(*std::move(blob));
  }
  return kept;
}

Result<proto::SourceFile> RequestFiles::blob(const proto::ContentHash& hash, const std::stop_token& stop) const {
  const auto found = files_.find(hash);
  if (found == files_.end()) return others_.blob(hash, stop);
  FileBudget::spend(found->second->size());
  return proto::SourceFile{found->second->path(), hash};
}

Result<proto::SourceFile> RequestFiles::asset(std::string_view relative_path, const std::stop_token& stop) const {
  return others_.asset(relative_path, stop);
}

Result<Asset> open_asset(Services& services, Request& request) {
  const std::string_view content_type = request.header("content-type").value_or("");
  AssetOpener opener(services, request.who, request.abandoned);
  if (is_media_type(content_type, "multipart/form-data")) return opener.open_form(content_type, *request.file);
  return opener.open_one({"body", std::string(content_type), request.file});
}

}  // namespace tessera::server
