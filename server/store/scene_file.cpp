#include "server/store/scene_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include <nlohmann/json.hpp>
#include <unistd.h>

#include "server/store/file_hash.h"
#include "server/store/storage_error.h"

namespace tessera::server {
namespace fs = std::filesystem;
using proto::ContentHash;

namespace {

constexpr std::string_view kHashBegin = "sha256:";
constexpr std::size_t kHashLength = kHashBegin.size() + 64;

std::optional<SceneFileHead> read_head(std::istream& file) {
  SceneFileHead head;
  std::string line;
  if (!std::getline(file, head.hash) || !proto::is_content_hash(head.hash) || !std::getline(file, line))
    return std::nullopt;
  std::istringstream names(line);
  head.blobs.assign(std::istream_iterator<std::string>(names), {});
  return head;
}

void collect_hashes(std::string_view text, std::set<ContentHash>& hashes) {
  for (std::size_t at = text.find(kHashBegin); at != std::string_view::npos; at = text.find(kHashBegin, at + 1))
    if (const std::string_view hash = text.substr(at, kHashLength); proto::is_content_hash(hash)) hashes.emplace(hash);
}

/// Looks at strings as they are meant, not as they are written.
struct HashesInStrings : nlohmann::json_sax<nlohmann::json> {
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t& text) override {
    collect_hashes(text, hashes);
    return true;
  }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return true; }
  bool key(string_t&) override { return true; }
  bool end_object() override { return true; }
  bool start_array(std::size_t) override { return true; }
  bool end_array() override { return true; }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

  std::set<ContentHash> hashes;
};

}  // namespace

std::string scene_file_head(const std::vector<ContentHash>& blobs, std::string_view document) {
  std::string names;
  for (const ContentHash& blob : blobs) names += (names.empty() ? "" : " ") + blob;
  names += '\n';
  proto::Sha256 sha256;
  sha256.update(names);
  sha256.update(document);
  return sha256.finish() + '\n' + names;
}

std::optional<SceneFile> read_scene_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  auto head = read_head(file);
  if (!head) return std::nullopt;
  SceneFile scene{std::move(head->blobs), {std::istreambuf_iterator<char>(file), {}}};
  if (file.bad()) throw StorageError(EIO, "cannot read " + path.string());
  return scene;
}

std::optional<SceneFileHead> read_scene_file_head(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return read_head(file);
}

bool is_whole_scene_file(int file, const std::string&, const std::stop_token& stop) {
  std::array<char, kHashLength + 1> line{};
  const ssize_t count = ::pread(file, line.data(), line.size(), 0);
  if (count < 0) throw_storage_error("cannot read a scene's document");
  const std::string_view hash(line.data(), kHashLength);
  return count == static_cast<ssize_t>(line.size()) && line.back() == '\n' && proto::is_content_hash(hash) &&
         hash_open_file(file, line.size(), stop) == hash;
}

std::vector<ContentHash> hashes_named_in(std::string_view document) {
  HashesInStrings strings;
  if (document.find('\\') == std::string_view::npos)
    collect_hashes(document, strings.hashes);
  else
    nlohmann::json::sax_parse(document, &strings);
  return {strings.hashes.begin(), strings.hashes.end()};
}

}  // namespace tessera::server
