#include "server/store/scene_store.h"

#include <fstream>
#include <iterator>
#include <optional>
#include <span>
#include <utility>

#include "server/http/lane.h"
#include "server/store/received_file.h"

namespace tessera::server {
using proto::ContentHash;
using proto::ParsedScene;
using proto::Problem;
using proto::ProblemCode;
using proto::Result;

namespace {

/// Of hashes.
constexpr std::uint64_t kMostDocuments = 4 << 20;

}  // namespace

Problem no_such_scene(const ContentHash& hash) {
  return {ProblemCode::not_found, "There is no scene " + hash + "; POST it to /v1/scenes.", {}};
}

SceneStore::SceneStore(std::filesystem::path folder, const proto::FileSource& files, proto::Limits limits,
                       std::uint64_t cache_bytes)
    : folder_(std::move(folder)), files_(files), limits_(limits), scenes_(cache_bytes), documents_(kMostDocuments) {}

std::filesystem::path SceneStore::path_of(const ContentHash& hash) const {
  return folder_ / (hash.substr(hash.find(':') + 1) + ".json");
}

Result<SceneStore::Put> SceneStore::put(std::string_view document, const proto::FileSource& files,
                                        const std::stop_token& abandoned) {
  auto parsed = proto::parse_scene(document, files, limits_, abandoned);
  if (!parsed) return parsed.problem();
  const std::filesystem::path path = path_of(parsed->hash);
  const bool known = std::filesystem::exists(path);
  if (!known) {
    ReceivedFile file(folder_);
    file.write(std::as_bytes(std::span(document)));
    file.keep_as(path);
  }
  return Put{share(*std::move(parsed)), known};
}

SceneStore::Found SceneStore::read(const ContentHash& hash, const std::stop_token& unwanted) const {
  std::ifstream file(path_of(hash), std::ios::binary);
  if (!file) return no_such_scene(hash);
  FileBudget::spend(std::filesystem::file_size(path_of(hash)));
  const std::string document{std::istreambuf_iterator<char>(file), {}};
  auto parsed = proto::parse_scene(document, files_, limits_, unwanted);
  if (!parsed) return parsed.problem();
  if (parsed->hash != hash)
    return Problem{ProblemCode::invalid_document, "Files that this scene names have changed; POST it again.", {}};
  return parsed->scene;
}

Result<ParsedScene> SceneStore::find(const ContentHash& hash, const std::stop_token& abandoned) {
  const auto make = [&](const std::stop_token& unwanted) {
    Found found = read(hash, unwanted);
    const auto bytes = found ? std::optional(memory_bytes(**found)) : std::nullopt;
    return Scenes::Made{std::move(found), bytes};
  };
  const Found found = scenes_.get(hash, make, abandoned);
  if (!found) return found.problem();
  return ParsedScene{*found, hash};
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
    if (const auto kept = scenes_.find(*hash)) return ParsedScene{**kept, *hash};
    documents_.drop_all(document_hash);
  }
}

ParsedScene SceneStore::share(ParsedScene parsed) {
  const std::uint64_t bytes = memory_bytes(*parsed.scene);
  parsed.scene = *scenes_.find_or_keep(parsed.hash, parsed.scene, bytes);
  return parsed;
}

}  // namespace tessera::server
