#pragma once

#include <cstddef>
#include <string_view>

namespace tessera::proto {

/// Walks through text by tokens between white space, counting lines. From `comment` to the end of its line text is
/// skipped. The text must outlive the cursor and its tokens.
class TextCursor {
 public:
  static constexpr char kNoComment = '\n';

  explicit TextCursor(std::string_view text, char comment, std::size_t first_line = 1)
      : at_(text.data()), end_(text.data() + text.size()), comment_(comment), line_(first_line) {}

  /// The next token; empty at the end of the text.
  std::string_view next() {
    skip_blanks(true);
    return token();
  }

  /// The next token of the current line; empty when the line has no more.
  std::string_view next_on_line() {
    skip_blanks(false);
    return token();
  }

  /// What hasn't been read, from the next token on; empty at the end of the text.
  std::string_view ahead() {
    skip_blanks(true);
    return rest();
  }

  /// Passes over the first `length` characters of `rest()`, which must hold no line's end.
  void pass(std::size_t length) { at_ += length; }

  /// What hasn't been read.
  std::string_view rest() const { return {at_, static_cast<std::size_t>(end_ - at_)}; }

  /// The line of the last token, or where the cursor stopped for lack of one; the first is 1.
  std::size_t line() const { return line_; }

  static bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

 private:
  void skip_blanks(bool across_lines) {
    for (; at_ != end_; ++at_) {
      if (*at_ == comment_) {
        while (at_ != end_ && *at_ != '\n') ++at_;
        if (at_ == end_) return;
      }
      if (*at_ == '\n') {
        if (!across_lines) return;
        ++line_;
      } else if (!is_blank(*at_)) {
        return;
      }
    }
  }

  std::string_view token() {
    const char* begin = at_;
    while (at_ != end_ && !is_blank(*at_) && *at_ != comment_) ++at_;
    return {begin, static_cast<std::size_t>(at_ - begin)};
  }

  const char* at_;
  const char* end_;
  char comment_;
  std::size_t line_;
};

}  // namespace tessera::proto
