#include "proto/scene_hash.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>
#include <vector>

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

}  // namespace

ContentHash scene_hash(const JsonCursor& scene, const FileIdentities& files) {
  CanonicalDump dump(scene, files);
  dump.value(scene);
  return dump.finish();
}

}  // namespace tessera::proto
