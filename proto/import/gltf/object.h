#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "proto/json_cursor.h"

namespace tessera::proto {

/// An object of a glTF document, whose members are found by name; others than those that are asked for may be there.
class GltfObject {
 public:
  /// An error, and no members, where `value` isn't an object; an error where its "name" isn't a string or its
  /// "extensions" aren't objects.
  explicit GltfObject(JsonCursor value);

  const JsonCursor& value() const { return value_; }

  std::optional<JsonCursor> find(std::string_view name) const;
  std::optional<JsonCursor> required(std::string_view name) const;

  /// The member as an object; nothing where it is missing or, with an error, something else.
  std::optional<GltfObject> object(std::string_view name) const;

  /// The elements of a member; nothing where it is missing. An error where it isn't an array or, which glTF forbids, is
  /// an empty one.
  std::vector<JsonCursor> array(std::string_view name) const;

  std::optional<GltfObject> extension(std::string_view name) const;

 private:
  void check_extensions() const;

  JsonCursor value_;
  bool is_object_;
};

/// The position of a glTF object in one of the document's arrays, which has `count` of them; nothing where the
/// reference is missing or, with an error, names none. `what` says what it names: "an accessor".
std::optional<std::uint32_t> read_reference(const std::optional<JsonCursor>& value, std::size_t count,
                                            std::string_view what);

/// Exactly as many numbers as `out` has, each in the range; `out` stays where they are missing or, with an error, won't
/// do.
bool read_numbers(const std::optional<JsonCursor>& value, std::span<double> out, const NumberRange& range = kAnyNumber);

/// A colour or a vector of material parameters.
bool read_numbers(const std::optional<JsonCursor>& value, std::span<float> out, const NumberRange& range = kAnyNumber);

}  // namespace tessera::proto
