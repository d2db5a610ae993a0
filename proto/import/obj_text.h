#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/abandoned.h"

namespace tessera::proto {

/// Walks through the lines of an OBJ or MTL file.
class ObjText {
 public:
  /// Puts blanks for comments behind faces and vertices, for carriage returns, for continued lines' ends, and for a
  /// byte order mark. Throws `BrokenFile` for UTF-16 and for bytes that are no text.
  ObjText(std::string text, std::string_view file_name, Steps& steps);

  /// Moves to the next line, at first to the first one; false, and nothing moves, when there is none.
  bool next();

  /// The line, without its end.
  std::string_view current() const { return current_; }

  /// Its number; the first is 1. Of a continued line it is where that ends.
  std::size_t line() const { return line_; }

 private:
  void mend_line_ends(Steps& steps);
  void mend_comments(Steps& steps);
  void join_continued_lines(Steps& steps);

  std::string text_;
  std::string_view current_;
  std::size_t next_ = 0;  ///< Offset of the line after the current one.
  std::size_t line_ = 0;
  std::vector<std::size_t> joined_;  ///< Offsets of line ends that are blanks now, ascending.
  std::size_t next_joined_ = 0;
};

/// Of ASCII; other bytes stay.
std::string lower_case(std::string_view word);

}  // namespace tessera::proto
