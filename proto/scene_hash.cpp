#include "proto/scene_hash.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "proto/wire/printable.h"

namespace tessera::proto {
namespace {

constexpr std::size_t kChunk = 1 << 16;

class CanonicalDump {
 public:
  CanonicalDump(const JsonCursor& scene, const FileIdentities& files) : scene_(scene), files_(files) {}

  void value(const JsonCursor& value) {
    switch (value.kind()) {
      case JsonKind::null:
        return write("null");
      case JsonKind::boolean:
        return write(value.document().boolean(value.index()) ? "true" : "false");
      case JsonKind::whole:
      case JsonKind::real:
        return number(value.number());
      case JsonKind::string:
        return string(value.string());
      case JsonKind::array:
        return array(value);
      case JsonKind::object:
        return object(value);
    }
  }

  ContentHash finish() {
    hash_.update(pending_);
    return hash_.finish();
  }

 private:
  void write(std::string_view text) {
    pending_ += text;
    if (pending_.size() >= kChunk) {
      hash_.update(pending_);
      pending_.clear();
    }
  }

  void number(double number) {
    std::array<char, 32> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
    write({digits.data(), static_cast<std::size_t>(end - digits.data())});
  }

  /// The length in front makes quotes and escapes unnecessary.
  void string(std::string_view text) {
    write(std::to_string(text.size()) + ":");
    write(text);
  }

  void array(const JsonCursor& array) {
    write("[");
    for (const JsonCursor& element : array.elements()) {
      value(element);
      write(",");
    }
    write("]");
  }

  void object(const JsonCursor& object) {
    const auto file = files_.find(object.index());
    std::vector<std::pair<std::string_view, JsonCursor>> members;
    object.each_member([&](std::string_view key, JsonCursor member) {
      if (object.index() == scene_.index() && key == "$schema") return;  // It says nothing of the scene.
      const bool names_file = key == "path" || key == "blob" || key == "format" || key == "companions";
      if (file == files_.end() || !names_file) members.emplace_back(key, member);
    });
    std::ranges::sort(members, {}, [](const auto& member) { return member.first; });
    write("{");
    if (file != files_.end()) identity(*file->second);
    for (const auto& [key, member] : members) {
      string(key);
      value(member);
      write(",");
    }
    write("}");
  }

  void identity(const FileIdentity& file) {
    string(file.content);
    if (file.format) string(name_of(file_format_names(), *file.format));
    for (const auto& [name, content] : file.companions) {
      string(name);
      string(content);
    }
    write(";");
  }

  const JsonCursor& scene_;
  const FileIdentities& files_;
  Sha256 hash_;
  std::string pending_;
};

class JsonDump {
 public:
  explicit JsonDump(const FileIdentities& files) : files_(files) {}

  void value(const JsonCursor& value) {
    switch (value.kind()) {
      case JsonKind::null:
        text_ += "null";
        break;
      case JsonKind::boolean:
        text_ += value.document().boolean(value.index()) ? "true" : "false";
        break;
      case JsonKind::whole:
        text_ += std::to_string(value.document().whole(value.index()));
        break;
      case JsonKind::real:
        real(value.number());
        break;
      case JsonKind::string:
        string(value.string());
        break;
      case JsonKind::array:
        array(value);
        break;
      case JsonKind::object:
        object(value);
        break;
    }
  }

  std::string finish() { return std::move(text_); }

 private:
  void real(double number) {
    std::array<char, 32> digits{};
    text_.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr);
    if (number == 0) text_ += ".0";  // An integer has no sign where it is read again.
  }

  void string(std::string_view text) { text_ += nlohmann::json(text).dump(); }

  void array(const JsonCursor& array) {
    text_ += '[';
    for (const JsonCursor& element : array.elements()) {
      if (text_.back() != '[') text_ += ',';
      value(element);
    }
    text_ += ']';
  }

  void object(const JsonCursor& object) {
    const FileIdentity* file = captured(object);
    text_ += '{';
    if (file) identity(*file);
    object.each_member([&](std::string_view key, JsonCursor member) {
      if (file && (key == "path" || key == "format")) return;
      if (text_.back() != '{') text_ += ',';
      string(key);
      text_ += ':';
      value(member);
    });
    text_ += '}';
  }

  /// What the object's file comes to, where it is to be named so.
  const FileIdentity* captured(const JsonCursor& object) const {
    const auto found = files_.find(object.index());
    if (found == files_.end()) return nullptr;
    bool has_path = false;
    object.each_member([&](std::string_view key, JsonCursor) { has_path |= key == "path"; });
    const auto is_named = [](const auto& companion) { return is_utf8(companion.first); };
    return has_path && std::ranges::all_of(found->second->companions, is_named) ? found->second : nullptr;
  }

  void identity(const FileIdentity& file) {
    nlohmann::json members{{"blob", file.content}};
    if (file.format) members["format"] = name_of(file_format_names(), *file.format);
    if (!file.companions.empty()) members["companions"] = file.companions;
    const std::string text = members.dump();
    text_ += std::string_view(text).substr(1, text.size() - 2);
  }

  const FileIdentities& files_;
  std::string text_;
};

}  // namespace

std::string document_by_content(const JsonCursor& scene, const FileIdentities& files) {
  JsonDump dump(files);
  dump.value(scene);
  return dump.finish();
}

ContentHash scene_hash(const JsonCursor& scene, const FileIdentities& files) {
  CanonicalDump dump(scene, files);
  dump.value(scene);
  return dump.finish();
}

}  // namespace tessera::proto
