#include "client/scene_files.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include <nlohmann/json.hpp>

#include "client/failure.h"
#include "proto/wire/material_libraries.h"
#include "proto/wire/material_textures.h"
#include "proto/wire/uri.h"

namespace tessera::client {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr const char* kAllowOutside = "--allow-outside lets it";

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

proto::ContentHash hash_of(const fs::path& path) {
  auto hash = proto::hash_file(path);
  if (!hash) throw Failure(Failure::Kind::local_file, "can't read " + path.string());
  return *std::move(hash);
}

std::string lower_case(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return text;
}

std::string format_by_ending(const fs::path& path) {
  const std::string ending = lower_case(path.extension().string());
  if (ending == ".gltf" || ending == ".glb") return "gltf";
  return ending == ".obj" || ending == ".ply" || ending == ".stl" || ending == ".nff" ? ending.substr(1) : "";
}

/// Finds files whose names differ from what was asked for in the case of letters.
class Folders {
 public:
  /// A file below `folder`; one whose name is as it was asked for comes first.
  std::optional<fs::path> find(const fs::path& folder, const fs::path& relative) {
    fs::path path = folder / relative;
    if (is_file(path) || relative.is_absolute()) return is_file(path) ? std::optional(path) : std::nullopt;
    path = folder;
    for (const fs::path& part : relative) {
      std::error_code error;
      if (fs::exists(path / part, error)) {
        path /= part;
        continue;
      }
      const auto& names = names_in(path);
      const auto found = names.find(lower_case(part.string()));
      if (found == names.end()) return std::nullopt;
      path /= found->second;
    }
    return is_file(path) ? std::optional(path) : std::nullopt;
  }

 private:
  using Names = std::map<std::string, std::string>;  ///< By themselves in lower case.

  const Names& names_in(const fs::path& folder) {
    const auto [entry, is_new] = listed_.try_emplace(folder);
    std::error_code error;
    if (is_new) {
      for (fs::directory_iterator at(folder.empty() ? "." : folder, error), end; !error && at != end;
           at.increment(error)) {
        std::string name = at->path().filename().string();
        std::string& kept = entry->second[lower_case(name)];
        if (kept.empty() || name < kept) kept = std::move(name);
      }
    }
    return entry->second;
  }

  std::map<fs::path, Names> listed_;
};

class Walk {
 public:
  explicit Walk(const SceneFolder& folder) : folder_(folder) {
    std::error_code error;
    root_ = fs::canonical(folder.folder.empty() ? "." : folder.folder, error);
  }

  void visit(json& value, const json::json_pointer& pointer) {
    if (value.is_object() && value.contains("path") && value["path"].is_string()) {
      const json type = value.value("type", json());
      if (type == "file") name_scene_file(value, (pointer / "path").to_string());
      if (type == "environment") name_by_content(value, (pointer / "path").to_string());
    }
    if (value.is_object())
      for (auto& [key, member] : value.items()) visit(member, pointer / key);
    if (value.is_array())
      for (std::size_t i = 0; i < value.size(); ++i) visit(value[i], pointer / i);
  }

  NamedFiles take_found() {
    if (!errors_.empty())
      throw Failure(Failure::Kind::local_file, "files that the document names aren't uploaded", std::move(errors_));
    return std::move(found_);
  }

 private:
  /// The file that `named` names, when it is here and may be sent.
  std::optional<fs::path> find(const json& named, const std::string& pointer) {
    const std::string written = named["path"];
    fs::path path = folder_.folder / written;
    if (!is_file(path)) {
      found_.left_to_server.push_back(written);
      return std::nullopt;
    }
    if (!may_send(path)) {
      errors_.push_back({pointer, written + " lies outside the document's folder; " + kAllowOutside});
      return std::nullopt;
    }
    return path;
  }

  void put_blob(json& named, const fs::path& path) {
    named["blob"] = add(path);
    named.erase("path");
  }

  void name_by_content(json& named, const std::string& pointer) {
    if (const auto path = find(named, pointer)) put_blob(named, *path);
  }

  void name_scene_file(json& file, const std::string& pointer) {
    const auto path = find(file, pointer);
    if (!path) return;
    const std::string written = file["path"];
    if (!file.contains("format")) {
      const proto::FileKind kind = proto::file_kind(*path);
      const std::string format = scene_file_format(*path, kind);
      if (format.empty()) {
        errors_.push_back({pointer, written + " is " + std::string(proto::description(kind)) +
                                        "; known are glTF, OBJ, PLY, STL and NFF"});
        return;
      }
      const std::string ending = format_by_ending(*path);
      if (!ending.empty() && ending != format)
        found_.notes.push_back(written + " is " + std::string(proto::description(kind)) + " and is read as one");
      file["format"] = format;
    }
    put_blob(file, *path);
    if (file.contains("companions")) return;
    if (file["format"] == "obj") add_companions(file, *path);
    if (file["format"] == "ply") add_texture(file, *path);
    if (file["format"] == "gltf") add_gltf_files(file, *path);
  }

  /// Of a PLY file's header, which begins it.
  void add_texture(json& file, const fs::path& ply) {
    std::string head(proto::kFileHead, '\0');
    std::ifstream bytes(ply, std::ios::binary);
    bytes.read(head.data(), static_cast<std::streamsize>(head.size()));
    head.resize(static_cast<std::size_t>(bytes.gcount()));
    std::vector<fs::path> outside;
    proto::TextureSearch search(
        [&](const std::string& name) { return take_companion(file, ply, name, outside).has_value(); });
    for (std::string_view rest = head; !rest.empty();) {
      const std::string_view line = rest.substr(0, rest.find_first_of("\r\n"));
      if (line.starts_with("end_header")) return;
      const std::string_view name = proto::ply_texture_file(line);
      if (!name.empty()) {
        if (!search.look_for("", name)) note_outside("texture", outside);
        return;  // as the server, who reads one
      }
      rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    }
  }

  void add_companions(json& file, const fs::path& obj) {
    std::vector<fs::path> outside;
    std::vector<std::pair<std::string, fs::path>> libraries;
    proto::LibrarySearch search([&](const std::string& name) {
      const auto path = take_companion(file, obj, name, outside);
      if (path) libraries.emplace_back(name, *path);
      return path.has_value();
    });
    each_statement(obj, proto::kLibraryKeywords, [&](std::string_view arguments) {
      outside.clear();
      if (!search.look_for(arguments)) note_outside("material library", outside);
    });

    proto::TextureSearch textures(
        [&](const std::string& name) { return take_companion(file, obj, name, outside).has_value(); });
    for (const auto& [name, path] : libraries)
      each_statement(path, proto::kTextureKeywords, [&](std::string_view arguments) {
        outside.clear();
        if (!textures.look_for(name, proto::split_texture_statement(arguments).file)) note_outside("texture", outside);
      });
  }

  /// The buffers and images of a glTF file that aren't in it.
  void add_gltf_files(json& file, const fs::path& gltf) {
    const json document = gltf_document(gltf);
    for (const char* kind : {"buffers", "images"}) {
      for (const json& element : document.value(kind, json::array())) {
        const json uri = element.is_object() ? element.value("uri", json()) : json();
        if (!uri.is_string() || proto::is_data_uri(uri.get<std::string>())) continue;
        const proto::CompanionName companion = proto::read_relative_uri(uri.get<std::string>());
        std::vector<fs::path> outside;
        if (companion.refusal.empty() && !take_companion(file, gltf, companion.name, outside))
          note_outside("file", outside);
      }
    }
  }

  /// What names files in it; nothing where it can't be read, which the server says.
  static json gltf_document(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    constexpr std::size_t kChunk = 20;  // where the text of a binary file begins, behind its size
    std::string text(kChunk, '\0');
    file.read(text.data(), kChunk);
    if (text.starts_with("glTF")) {
      std::uint32_t size = 0;
      for (int i = 0; i < 4; ++i) size |= std::uint32_t{static_cast<unsigned char>(text[12 + i])} << (8 * i);
      std::error_code error;
      text.resize(std::min<std::uintmax_t>(size, fs::file_size(path, error)));
      file.read(text.data(), static_cast<std::streamsize>(text.size()));
    } else {
      file.clear();
      file.seekg(0);
      text.assign(std::istreambuf_iterator<char>(file), {});
    }
    const auto of_use = [](int depth, json::parse_event_t event, const json& key) {
      return depth != 1 || event != json::parse_event_t::key || key == "buffers" || key == "images";
    };
    json document = json::parse(text, of_use, false);
    return document.is_object() ? document : json::object();
  }

  /// Adds a companion of that name, relative to the file, if it is there and may be sent; else, if it is there, to
  /// `outside`.
  std::optional<fs::path> take_companion(json& file, const fs::path& named_by, const std::string& name,
                                         std::vector<fs::path>& outside) {
    const std::optional<fs::path> path = folders_.find(named_by.parent_path(), name);
    if (!path) return std::nullopt;
    if (!may_send(*path)) {
      outside.push_back(*path);
      return std::nullopt;
    }
    file["companions"][name] = add(*path);
    return path;
  }

  void note_outside(const std::string& what, const std::vector<fs::path>& outside) {
    for (const fs::path& path : outside)
      found_.notes.push_back("the " + what + ' ' + path.string() + " lies outside the document's folder and isn't " +
                             "uploaded; " + kAllowOutside);
  }

  template <typename Visit>
  static void each_statement(const fs::path& path, std::span<const std::string_view> keywords, const Visit& visit) {
    proto::StatementScanner scanner(keywords, [&](std::string_view, std::string_view arguments) { visit(arguments); });
    std::ifstream text(path, std::ios::binary);
    std::vector<char> piece(1 << 20);
    while (text) {
      text.read(piece.data(), static_cast<std::streamsize>(piece.size()));
      scanner.feed({piece.data(), static_cast<std::size_t>(text.gcount())});
    }
    scanner.finish();
  }

  /// Whether the file lies in the document's folder, wherever symbolic links lead, or may lie anywhere.
  bool may_send(const fs::path& path) const {
    const auto is_this = [&](const fs::path& named) { return path.lexically_normal() == named.lexically_normal(); };
    if (folder_.allow_outside || std::ranges::any_of(folder_.named, is_this)) return true;
    std::error_code error;
    const fs::path real = fs::canonical(path, error);
    return !error && !root_.empty() && std::ranges::mismatch(root_, real).in1 == root_.end();
  }

  const proto::ContentHash& add(const fs::path& path) {
    const auto [entry, is_new] = hashes_.try_emplace(path.lexically_normal());
    if (is_new) {
      entry->second = hash_of(path);
      found_.to_upload.push_back({path, entry->second});
    }
    return entry->second;
  }

  SceneFolder folder_;
  fs::path root_;  ///< The folder without links; empty when it can't be found.
  Folders folders_;
  std::map<fs::path, proto::ContentHash> hashes_;
  std::vector<proto::FieldError> errors_;
  NamedFiles found_;
};

}  // namespace

NamedFiles name_files_by_content(json& document, const SceneFolder& folder) {
  Walk walk(folder);
  walk.visit(document, json::json_pointer());
  return walk.take_found();
}

std::string scene_file_format(const fs::path& path, proto::FileKind kind) {
  switch (kind) {
    case proto::FileKind::obj:
      return "obj";
    case proto::FileKind::ply:
      return "ply";
    case proto::FileKind::stl_ascii:
    case proto::FileKind::stl_binary:
      return "stl";
    case proto::FileKind::nff:
      return "nff";
    case proto::FileKind::gltf:
    case proto::FileKind::glb:
      return "gltf";
    case proto::FileKind::json:  // A glTF file whose beginning doesn't tell.
      return format_by_ending(path) == "gltf" ? "gltf" : "";
    case proto::FileKind::unknown:
      return format_by_ending(path);
    default:
      return "";
  }
}

}  // namespace tessera::client
