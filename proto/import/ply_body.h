#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "proto/import/ply_header.h"
#include "proto/import/text_cursor.h"

namespace tessera::proto {

/// Values of a PLY body, one after the other. Both kinds of body have the same functions, so that what reads
/// elements is written once.
class PlyTextBody {
 public:
  PlyTextBody(std::string_view bytes, const PlyHeader& header, std::string_view file_name)
      : cursor_(bytes.substr(header.body), TextCursor::kNoComment, header.body_line), file_name_(file_name) {}

  /// Bytes that a value of this type takes at least: a digit, and a blank after it.
  static std::size_t least_size(PlyScalar) { return 2; }
  /// The last value needs no blank after it.
  std::size_t bytes_left() const { return cursor_.rest().size() + 1; }
  std::string_view rest() const { return cursor_.rest(); }
  std::size_t line() const { return cursor_.line(); }

  float number(PlyScalar type);
  std::int64_t integer(PlyScalar type);
  void skip(PlyScalar type, std::uint64_t times);

  /// That as many values follow. Text finds out when it reads them.
  static void need(PlyScalar, std::uint64_t) {}

  /// How many bytes the elements after the current one take at least; for the error when the file ends early.
  void expect_after(std::uint64_t) {}

 private:
  /// Throws the error of the next token, which isn't the `expected`.
  [[noreturn]] void fail(const std::string& expected);

  TextCursor cursor_;
  std::string_view file_name_;
};

class PlyBinaryBody {
 public:
  PlyBinaryBody(std::string_view bytes, const PlyHeader& header, std::string_view file_name);

  static std::size_t least_size(PlyScalar type) { return size_of(type); }
  std::size_t bytes_left() const { return static_cast<std::size_t>(end_ - at_); }
  std::string_view rest() const { return {at_, bytes_left()}; }
  static std::size_t line() { return 0; }

  float number(PlyScalar type);
  std::int64_t integer(PlyScalar type);
  void skip(PlyScalar type, std::uint64_t times);
  void need(PlyScalar type, std::uint64_t times) const;

  void expect_after(std::uint64_t bytes) { expected_after_ = bytes; }

 private:
  template <typename T>
  T load();

  const char* at_;
  const char* end_;
  bool swap_;
  std::uint64_t expected_after_ = 0;
  std::string_view file_name_;
};

/// Throws the error of a body that is too short.
[[noreturn]] void fail_short(std::string_view file_name, std::uint64_t missing);

}  // namespace tessera::proto
