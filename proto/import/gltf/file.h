#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>

#include "proto/import/gltf/object.h"
#include "proto/import/import.h"
#include "proto/import/import_notes.h"
#include "proto/json_document.h"

namespace tessera::proto {

/// A glTF file while it is imported: its document, the files beside it, and what is wrong with it, lost or ignored,
/// each with the JSON pointer of its place.
class GltfFile {
 public:
  /// `json` is the document's text; `bytes` the size of the whole file. Throws `BrokenFile` for what isn't JSON.
  GltfFile(std::string_view json, std::uint64_t bytes, std::string_view name, const CompanionSource& companions,
           const std::stop_token& stop);

  GltfFile(const GltfFile&) = delete;
  GltfFile& operator=(const GltfFile&) = delete;

  GltfObject root() { return GltfObject(JsonCursor(document_, errors_)); }
  FieldErrors& errors() { return errors_; }
  Steps& steps() { return errors_.steps(); }
  ImportNotes& notes() { return notes_; }

  /// Tells of something that is lost or ignored there, a sentence without its full stop.
  void note(const JsonCursor& where, std::string_view what, std::uint64_t times = 1) {
    notes_.add(what, where.index(), times);
  }

  /// Says what is wrong with one of the `ImportOptions`, which is no fault of the file's.
  void refuse_option(std::string name, std::string why) { errors_.add(std::move(name), std::move(why)); }
  /// How messages name the place of a JSON pointer. Pointers into the document are empty or begin with a slash; others
  /// are names of options.
  std::string place(const std::string& pointer) const {
    return pointer.empty() || pointer.starts_with('/') ? name_ + pointer : pointer;
  }

  /// Throws `BrokenFile` where there were errors.
  void refuse_if_broken();

  /// The file that a relative URI names; nothing, with the reason in `why`, when there is none.
  struct Companion {
    std::string name;
    InputFile file;
  };
  std::optional<Companion> find_companion(std::string_view uri, std::string& why);

  /// All of it, shared with those who still have it; null, with the reason in `why`, when it can't be read.
  std::shared_ptr<const std::string> read_companion(const Companion& companion, std::string& why);

  /// Counts memory that is about to be taken. An error there, and false, beyond a multiple of the files' bytes: then a
  /// few numbers stand for far more than any file of that size holds.
  bool take(std::uint64_t bytes, const JsonCursor& where);

 private:
  static JsonDocument parsed(std::string_view json, std::string_view name, FieldErrors& errors);

  std::string name_;
  const CompanionSource& companions_;
  std::stop_token stop_;
  FieldErrors errors_;
  JsonDocument document_;
  ImportNotes notes_;
  std::uint64_t budget_;
  std::map<std::filesystem::path, std::weak_ptr<const std::string>> companions_read_;  ///< The budget grew by each.
};

}  // namespace tessera::proto
