#include "proto/import/obj_text.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "proto/import/broken_file.h"

namespace tessera::proto {
namespace {

/// `text.find`, in pieces.
std::size_t find(std::string_view text, char c, std::size_t from, Steps& steps) {
  constexpr std::size_t kPiece = 1 << 22, kSteps = 1 << 10;
  for (; from < text.size(); from += kPiece) {
    steps.take(kSteps);
    const std::size_t at = text.substr(from, kPiece).find(c);
    if (at != std::string_view::npos) return from + at;
  }
  return std::string_view::npos;
}

std::ptrdiff_t offset(std::size_t n) { return static_cast<std::ptrdiff_t>(n); }

char first_character(std::string_view line) {
  const std::size_t at = line.find_first_not_of(" \t");
  return at == std::string_view::npos ? '\0' : line[at];
}

}  // namespace

ObjText::ObjText(std::string text, std::string_view file_name, Steps& steps) : text_(std::move(text)) {
  if (text_.starts_with("\xFE\xFF") || text_.starts_with("\xFF\xFE")) {
    throw BrokenFile{{{file_place(file_name, 1), "The file is UTF-16: save it as UTF-8"}}};
  }
  if (const std::size_t nul = find(text_, '\0', 0, steps); nul != std::string::npos) {
    const auto line = std::count(text_.begin(), text_.begin() + offset(nul), '\n') + 1;
    throw BrokenFile{{{file_place(file_name, static_cast<std::size_t>(line)), "A byte 0: this is no text"}}};
  }
  if (text_.starts_with("\xEF\xBB\xBF")) text_.replace(0, 3, "   ");
  mend_line_ends(steps);
  mend_comments(steps);
  join_continued_lines(steps);
}

void ObjText::mend_line_ends(Steps& steps) {
  for (std::size_t at = 0; (at = find(text_, '\r', at, steps)) != std::string::npos; ++at) {
    text_[at] = at + 1 < text_.size() && text_[at + 1] == '\n' ? ' ' : '\n';
  }
}

void ObjText::mend_comments(Steps& steps) {
  const std::string_view text = text_;
  for (std::size_t at = 0; (at = find(text, '#', at, steps)) != std::string::npos;) {
    const std::size_t begin = at == 0 ? 0 : text.rfind('\n', at) + 1;  // npos + 1 is 0.
    const std::size_t end = std::min(text.find('\n', at), text.size());
    // Names may hold a #, and so may numbers (1.#INF).
    const char kind = first_character(text.substr(begin, end - begin));
    while (at < end && text[at] == '#' && at > begin && text[at - 1] != ' ' && text[at - 1] != '\t') {
      at = std::min(text.find('#', at + 1), end);
    }
    if (kind == 'f' || kind == 'v') std::fill(text_.begin() + offset(at), text_.begin() + offset(end), ' ');
    at = end;
  }
}

void ObjText::join_continued_lines(Steps& steps) {
  const std::string_view text = text_;
  for (std::size_t at = 0; (at = find(text, '\\', at, steps)) != std::string::npos; ++at) {
    const std::size_t end = text.find_first_not_of(" \t", at + 1);
    if (end == std::string::npos || text[end] != '\n') continue;
    // A line that continues one that was joined is no comment.
    const std::size_t from = joined_.empty() ? 0 : joined_.back() + 1;
    const std::size_t line_end = text.substr(from, at - from).rfind('\n');
    const bool continues = line_end == std::string::npos && from > 0;
    if (!continues && first_character(text.substr(from + line_end + 1)) == '#') continue;
    text_[at] = text_[end] = ' ';
    joined_.push_back(end);
  }
}

bool ObjText::next() {
  if (next_ >= text_.size()) return false;
  const std::size_t end = std::min(text_.find('\n', next_), text_.size());
  current_ = std::string_view(text_).substr(next_, end - next_);
  next_ = end + 1;
  ++line_;
  for (; next_joined_ < joined_.size() && joined_[next_joined_] < end; ++next_joined_) ++line_;
  return true;
}

std::string lower_case(std::string_view word) {
  std::string lower(word);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return lower;
}

}  // namespace tessera::proto
