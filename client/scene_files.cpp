#include "client/scene_files.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>

#include <nlohmann/json.hpp>

#include "client/failure.h"

namespace tessera::client {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

proto::ContentHash hash_of(const fs::path& path) {
  auto hash = proto::hash_file(path);
  if (!hash) throw Failure(Failure::Kind::local_file, "can't read " + path.string());
  return *std::move(hash);
}

/// Adds the names after every `mtllib` that begins a line of `text`, to the line's end.
void add_material_libraries(std::string_view text, std::set<std::string>& names) {
  constexpr std::string_view kKeyword = "mtllib";
  for (auto at = text.find(kKeyword); at != text.npos; at = text.find(kKeyword, at + 1)) {
    const std::string_view before = text.substr(0, at);
    const auto start = before.find_last_not_of(" \t");
    if (start != before.npos && before[start] != '\n') continue;
    const auto end = std::min(text.find('\n', at), text.size());
    std::istringstream words(std::string(text.substr(at + kKeyword.size(), end - at - kKeyword.size())));
    names.insert(std::istream_iterator<std::string>(words), {});
  }
}

/// The names after every `mtllib` of an OBJ file, which may name several on a line.
std::set<std::string> material_libraries(const fs::path& obj) {
  constexpr std::size_t kPiece = 1 << 20;
  std::set<std::string> names;
  std::ifstream file(obj, std::ios::binary);
  std::string text;  // What isn't looked through yet; it starts where a line does.
  while (file) {
    const std::size_t held = text.size();
    text.resize(held + kPiece);
    file.read(text.data() + held, kPiece);
    text.resize(held + static_cast<std::size_t>(file.gcount()));
    const std::size_t whole_lines = file ? text.rfind('\n') + 1 : text.size();  // npos + 1 is 0.
    add_material_libraries(std::string_view(text).substr(0, whole_lines), names);
    text.erase(0, whole_lines);
  }
  return names;
}

class Walk {
 public:
  explicit Walk(fs::path folder) : folder_(std::move(folder)) {}

  void visit(json& value) {
    if (value.is_object() && value.value("type", json()) == "file" && value.contains("path")) name_by_content(value);
    if (value.is_structured()) std::ranges::for_each(value, [this](json& child) { visit(child); });
  }

  NamedFiles take_found() { return std::move(found_); }

 private:
  void name_by_content(json& file) {
    const json& written = file["path"];
    if (!written.is_string()) return;
    const fs::path path = folder_ / written.get<std::string>();
    if (!is_file(path)) {
      found_.left_to_server.push_back(written.get<std::string>());
      return;
    }
    if (!file.contains("format")) {
      const std::string format = scene_file_format(path);
      if (format.empty()) return;
      file["format"] = format;
    }
    file["blob"] = add(path);
    file.erase("path");
    if (file["format"] == "obj" && !file.contains("companions")) add_companions(file, path);
  }

  void add_companions(json& file, const fs::path& obj) {
    for (const std::string& name : material_libraries(obj)) {
      const fs::path path = obj.parent_path() / name;
      if (is_file(path)) file["companions"][name] = add(path);
    }
  }

  const proto::ContentHash& add(const fs::path& path) {
    const auto [entry, is_new] = hashes_.try_emplace(path);
    if (is_new) {
      entry->second = hash_of(path);
      found_.to_upload.push_back({path, entry->second});
    }
    return entry->second;
  }

  fs::path folder_;
  std::map<fs::path, proto::ContentHash> hashes_;
  NamedFiles found_;
};

}  // namespace

NamedFiles name_files_by_content(json& document, const fs::path& folder) {
  Walk walk(folder);
  walk.visit(document);
  return walk.take_found();
}

std::string scene_file_format(const fs::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending == ".obj" || ending == ".ply" || ending == ".nff" ? ending.substr(1) : "";
}

}  // namespace tessera::client
