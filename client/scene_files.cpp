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

/// The names after every `mtllib` of an OBJ file, which may name several on a line.
std::set<std::string> material_libraries(const fs::path& obj) {
  std::set<std::string> names;
  std::ifstream file(obj, std::ios::binary);
  for (std::string line; std::getline(file, line);) {
    const auto start = line.find_first_not_of(" \t");
    if (start == line.npos || line.compare(start, 6, "mtllib") != 0) continue;
    std::istringstream words(line.substr(start + 6));
    names.insert(std::istream_iterator<std::string>(words), {});
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
