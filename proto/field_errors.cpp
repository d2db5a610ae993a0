#include "proto/field_errors.h"

namespace tessera::proto {
namespace {

constexpr std::size_t kLongestQuote = 60;
constexpr std::size_t kLongestKey = 200;

std::string cut(std::string_view text, std::size_t longest) {
  if (text.size() <= longest) return std::string(text);
  while (longest > 0 && (text[longest] & 0xC0) == 0x80) --longest;  // not inside a UTF-8 sequence
  return std::string(text.substr(0, longest)) + "…";
}

}  // namespace

Problem FieldErrors::as_problem(std::string_view document) && {
  const std::string count = full()              ? "at least " + std::to_string(size()) + " errors"
                            : list_.size() == 1 ? "one error"
                                                : std::to_string(size()) + " errors";
  return {ProblemCode::invalid_document, "The " + std::string(document) + " has " + count + "; `errors` says where.",
          std::move(list_)};
}

std::string in_quotes(std::string_view text) { return "\"" + cut(text, kLongestQuote) + "\""; }

std::string pointer_part(std::string_view key) {
  std::string part = "/";
  for (const char c : cut(key, kLongestKey)) {
    if (c == '~') {
      part += "~0";
    } else if (c == '/') {
      part += "~1";
    } else {
      part += c;
    }
  }
  return part;
}

}  // namespace tessera::proto
