#include "server/store/scene_store.h"

#include <cerrno>
#include <fstream>
#include <iterator>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "server/http/lane.h"
#include "server/store/blob_store.h"
#include "server/store/file_descriptor.h"
#include "server/store/held_files.h"
#include "server/store/received_file.h"
#include "server/store/scene_file.h"
#include "server/store/storage_error.h"

namespace tessera::server {
namespace fs = std::filesystem;
using proto::ContentHash;
using proto::ParsedScene;
using proto::Problem;
using proto::ProblemCode;
using proto::Result;

Problem no_such_scene(const ContentHash& hash) {
  return {ProblemCode::not_found, "There is no scene " + hash + "; POST it to /v1/scenes.", {}};
}

namespace {

/// Of hashes.
constexpr std::uint64_t kMostDocuments = 4 << 20;

Problem no_scene(const ContentHash& hash, Shelf::State state) {
  if (state == Shelf::State::expired)
    return {ProblemCode::gone, "The scene " + hash + " has expired; POST it again to /v1/scenes.", {}};
  if (state == Shelf::State::damaged)
    return {
        ProblemCode::not_found,
        "The scene " + hash + " was damaged on the server's disk and has been set aside; POST it again to /v1/scenes.",
        {}};
  return no_such_scene(hash);
}

ContentHash hash_of_digits(const std::string& digits) { return "sha256:" + digits; }

}  // namespace

SceneStore::SceneStore(fs::path folder, fs::path set_aside, const BlobStore& files, proto::Limits limits,
                       std::uint64_t cache_bytes)
    : folder_(std::move(folder)),
      files_(files),
      limits_(limits),
      shelf_(folder_, kSceneExtension, is_whole_scene_file, std::move(set_aside)),
      scenes_(cache_bytes),
      documents_(kMostDocuments) {
  adopt_older_files();
  read_references();
}

/// Earlier versions kept bare documents. They get the lines that let them be checked, and go when all of those are on
/// the disk.
void SceneStore::adopt_older_files() const {
  std::vector<fs::path> older;
  for (const auto& entry : fs::directory_iterator(folder_)) {
    const fs::path& path = entry.path();
    if (path.extension() != ".json" || !proto::is_content_hash(hash_of_digits(path.stem().string()))) continue;
    std::ifstream in(path, std::ios::binary);
    const std::string document{std::istreambuf_iterator<char>(in), {}};
    const fs::path fresh = folder_ / (std::string(kReceivedFilePrefix) + path.stem().string());
    std::ofstream out(fresh, std::ios::binary);
    out << scene_file_head(hashes_named_in(document), document) << document;
    out.close();
    if (!in || !out) throw StorageError(EIO, "cannot bring " + path.string() + " to this version");
    fs::rename(fresh, shelf_.path_of(path.stem().string()));
    older.push_back(path);
  }
  if (older.empty()) return;
  const FileDescriptor folder(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder || ::syncfs(folder.value()) != 0) throw_storage_error("cannot sync " + folder_.string());
  for (const fs::path& path : older) fs::remove(path);
  spdlog::info("{} scenes of an earlier version have been brought to this one's", older.size());
}

void SceneStore::read_references() {
  for (const std::string& name : shelf_.names())
    if (auto head = read_scene_file_head(shelf_.path_of(name))) references_.set(name, std::move(head->blobs));
}

Result<SceneStore::Put> SceneStore::put(std::string_view document, const proto::FileSource& files,
                                        const std::stop_token& abandoned) {
  const HeldFiles held(files);
  auto parsed = proto::parse_scene(document, held, limits_, abandoned);
  if (!parsed) return parsed.problem();
  auto hold = shelf_.hold(hash_digits(parsed->hash));
  const auto known = keep(*parsed, document, abandoned);
  if (!known) return known.problem();
  return Put{share(*std::move(parsed)), *known, std::move(hold)};
}

bool SceneStore::is_kept(const ContentHash& hash, const std::stop_token& abandoned) {
  return shelf_.find(hash_digits(hash), abandoned).state == Shelf::State::whole;
}

Result<bool> SceneStore::keep(const ParsedScene& scene, std::string_view document, const std::stop_token& abandoned) {
  if (!scene.captured) return keep_document(scene.hash, document, abandoned);
  std::vector<proto::SourceFile> held;
  for (const proto::SourceFile& file : scene.captured->files) {
    auto blob = files_.capture(file, abandoned);
    if (!blob) return blob.problem();
    held.push_back(*std::move(blob));
  }
  return keep_document(scene.hash, scene.captured->document, abandoned);
}

bool SceneStore::keep_document(const ContentHash& hash, std::string_view document, const std::stop_token& abandoned) {
  const std::string name = hash_digits(hash);
  std::vector<ContentHash> blobs = hashes_named_in(document);
  const std::string head = scene_file_head(blobs, document);
  const auto held = shelf_.hold(name);
  const Shelf::Found found = shelf_.find(name, abandoned);
  const bool known = found.state == Shelf::State::whole;
  if (known) {
    const auto there = read_scene_file_head(shelf_.path_of(name));
    if (there && head.starts_with(there->hash)) return true;
  }
  ReceivedFile file(folder_);
  file.write(std::as_bytes(std::span(head)));
  file.write(std::as_bytes(std::span(document)));
  references_.set(name, std::move(blobs));  // First, so that none of them is removed once it is there.
  try {
    shelf_.replace(name, file);
  } catch (const StorageError&) {
    if (!known) references_.drop(name);
    throw;
  }
  return known;
}

SceneStore::Found SceneStore::read(const ContentHash& hash, const std::stop_token& unwanted) {
  const std::string name = hash_digits(hash);
  const Shelf::Found found = shelf_.find(name, unwanted);
  if (found.state != Shelf::State::whole) return no_scene(hash, found.state);
  const auto file = read_scene_file(shelf_.path_of(name));
  if (!file) throw StorageError(EIO, "cannot read " + shelf_.path_of(name).string());
  auto parsed = proto::parse_scene(file->document, files_, limits_, unwanted);
  if (!parsed && parsed.problem().code == ProblemCode::malformed_json) {  // So it was when an older file was adopted.
    shelf_.set_aside_as_damaged(name, "it is no scene");
    return no_scene(hash, Shelf::State::damaged);
  }
  if (!parsed) return parsed.problem();
  if (parsed->hash != hash)
    return Problem{ProblemCode::invalid_document, "Files that this scene names have changed; POST it again.", {}};
  if (parsed->captured) {  // An earlier version of this program has left the paths in.
    if (const auto kept = keep(*parsed, file->document, unwanted); !kept) return kept.problem();
  }
  return parsed->scene;
}

Result<ParsedScene> SceneStore::find(const ContentHash& hash, const std::stop_token& abandoned) {
  auto hold = shelf_.hold(hash_digits(hash));
  const auto make = [&](const std::stop_token& unwanted) {
    Found found = read(hash, unwanted);
    const auto bytes = found ? std::optional(memory_bytes(**found)) : std::nullopt;
    return Scenes::Made{std::move(found), bytes};
  };
  shelf_.touch(hash_digits(hash));
  const Found found = scenes_.get(hash, make, abandoned);
  if (!found) return found.problem();
  return ParsedScene{*found, hash, std::move(hold)};
}

Shelf::Swept SceneStore::sweep(const Shelf::Limits& limits, const std::stop_token& stop) {
  Shelf::Swept swept = shelf_.sweep(
      limits, [](const std::string&) { return false; }, stop);
  for (const std::string& name : swept.names) {
    references_.drop(name);
    scenes_.drop_all(hash_of_digits(name));
  }
  return swept;
}

Shelf::Removal SceneStore::remove(const ContentHash& hash, const std::function<bool()>& is_needed) {
  const std::string name = hash_digits(hash);
  const bool is_in_memory = scenes_.find(hash).has_value();
  const auto removal = shelf_.remove(name, is_needed);
  if (removal == Shelf::Removal::held || removal == Shelf::Removal::needed) return removal;
  references_.drop(name);
  scenes_.drop_all(hash);
  return is_in_memory ? Shelf::Removal::removed : removal;
}

Result<ParsedScene> SceneStore::parse_once(const ContentHash& document_hash, std::string_view document,
                                           const proto::FileSource& files, const std::stop_token& abandoned) {
  for (;;) {
    std::optional<ParsedScene> scene;
    const auto make = [&](const std::stop_token& unwanted) -> decltype(documents_)::Made {
      auto parsed = proto::parse_scene(document, files, limits_, unwanted);
      if (!parsed) return {parsed.problem(), std::nullopt};
      scene = share(*std::move(parsed));
      return {scene->hash, 0};
    };
    const auto hash = documents_.get(document_hash, make, abandoned);
    if (!hash) return hash.problem();
    if (scene) return *std::move(scene);
    if (const auto kept = scenes_.find(*hash)) return ParsedScene{**kept, *hash, shelf_.hold(hash_digits(*hash))};
    documents_.drop_all(document_hash);
  }
}

ParsedScene SceneStore::share(ParsedScene parsed) {
  parsed.hold = shelf_.hold(hash_digits(parsed.hash));
  const std::uint64_t bytes = memory_bytes(*parsed.scene);
  parsed.scene = *scenes_.find_or_keep(parsed.hash, parsed.scene, bytes);
  return parsed;
}

}  // namespace tessera::server
