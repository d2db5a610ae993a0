#pragma once

#include <cstddef>
#include <streambuf>
#include <string>
#include <string_view>
#include <vector>

namespace tessera::proto {

/// The text of an OBJ or MTL file as the stream that tinyobjloader wants, which also knows which line the loader
/// has read last: the loader tells neither its line nor its text.
class ObjText : public std::streambuf {
 public:
  /// Mends in place what the loader misreads: blanks for comments behind faces and vertices, for lone or trailing
  /// carriage returns, for continued lines' ends, and for a byte order mark. Throws `BrokenFile` for UTF-16 and for
  /// bytes that are no text.
  ObjText(std::string text, std::string_view file_name);

  /// Where the loader stands: moves to the line that it has read last, and calls `skipped(line)` for every line
  /// since the one before.
  template <typename Skipped>
  void follow(const Skipped& skipped) {
    const auto read = static_cast<std::size_t>(gptr() - eback());
    while (next_ < read) {
      advance();
      if (next_ < read) skipped(current_);
    }
  }

  /// Calls `skipped(line)` for the lines that are left.
  template <typename Skipped>
  void finish(const Skipped& skipped) {
    while (next_ < text_.size()) {
      advance();
      skipped(current_);
    }
  }

  /// The line that was followed to, without its end.
  std::string_view current() const { return current_; }

  /// Its number; the first is 1. Of a continued line it is where that ends.
  std::size_t line() const { return line_; }

 private:
  void mend_line_ends();
  void mend_comments();
  void join_continued_lines();
  void advance();

  std::string text_;
  std::string_view current_;
  std::size_t next_ = 0;  ///< Offset of the line after the current one.
  std::size_t line_ = 0;
  std::vector<std::size_t> joined_;  ///< Offsets of line ends that are blanks now, ascending.
  std::size_t next_joined_ = 0;
};

}  // namespace tessera::proto
