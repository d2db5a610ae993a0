#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "proto/field_errors.h"
#include "proto/wire/result.h"

namespace tessera::proto {

/// `whole` is a number written without fraction, exponent or minus sign that fits 64 bits; `real` any other.
enum class JsonKind : std::uint32_t { null, boolean, whole, real, string, array, object };

/// A JSON text, parsed and immutable. The values lie in one array in document order, a container before its
/// children, so that a text costs 16 bytes a value whatever its shape, and a big mesh is read in one forward walk.
/// An object's children alternate between keys (strings) and values.
class JsonDocument {
 public:
  using Index = std::uint32_t;
  static constexpr Index kRoot = 0;

  /// `malformed_json` when `bytes` isn't JSON (RFC 8259, UTF-8 without a byte order mark) or nests deeper than
  /// `max_depth`; `invalid_document` when a number overflows. A key that an object repeats goes to `errors`.
  /// Takes no stack per level of nesting. Throws `Abandoned` when the errors' stop is requested.
  static Result<JsonDocument> parse(std::string_view bytes, std::uint32_t max_depth, FieldErrors& errors);

  JsonKind kind(Index i) const { return nodes_[i].kind; }
  bool boolean(Index i) const { return nodes_[i].whole != 0; }
  std::uint64_t whole(Index i) const { return nodes_[i].whole; }

  /// Any number, to the nearest double.
  double number(Index i) const {
    return kind(i) == JsonKind::whole ? static_cast<double>(nodes_[i].whole) : nodes_[i].real;
  }
  std::string_view string(Index i) const {
    return std::string_view(text_).substr(nodes_[i].text.offset, nodes_[i].text.size);
  }

  /// The number of elements of an array, or of members of an object.
  std::uint32_t size(Index i) const { return nodes_[i].size; }

  /// The node after `i` and all that `i` holds: the next sibling, or the parent's own `next`.
  Index next(Index i) const { return nodes_[i].next; }

  /// The JSON pointer from `base`, a container of `i` (or `i`), to `i`. Walks down from `base`: for messages.
  std::string pointer(Index i, Index base = kRoot) const;

 private:
  friend class JsonDocumentBuilder;

  struct Node {
    struct Text {
      std::uint32_t offset, size;
    };
    union {
      std::uint64_t whole = 0;
      double real;
      Text text;
      std::uint32_t size;
    };
    Index next = 0;
    JsonKind kind = JsonKind::null;
  };
  static_assert(sizeof(Node) == 16);

  std::vector<Node> nodes_;
  std::string text_;  // every string and key, unescaped, one after the other
};

}  // namespace tessera::proto
