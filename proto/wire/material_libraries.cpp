#include "proto/wire/material_libraries.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

namespace tessera::proto {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::string_view kBlanks = " \t\v\f\r\n";

/// A longer statement is cut off: no file's name is as long.
constexpr std::size_t kLongestStatement = 1 << 20;

constexpr std::size_t kLongestName = 4096;

/// Words of one name; of more words, that many are tried.
constexpr std::size_t kMostWordsOfName = 16;

bool is_blank(char c) { return kBlanks.find(c) != kBlanks.npos; }

char lower_case(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool equals_in_any_case(std::string_view text, std::string_view lower) {
  return std::ranges::equal(text, lower, {}, lower_case);
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == text.npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) + 1 - begin);
}

bool ends_a_name(std::string_view word) {
  constexpr std::string_view kEnding = ".mtl";
  return word.size() >= kEnding.size() && equals_in_any_case(word.substr(word.size() - kEnding.size()), kEnding);
}

}  // namespace

std::string with_slashes(std::string_view name) {
  std::string path;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (name[i] != '\\') {
      path += name[i];
    } else if (i + 1 == name.size() || name[i + 1] != ' ') {
      path += '/';
    }
  }
  return path;
}

bool is_mtllib(std::string_view keyword) { return equals_in_any_case(keyword, kLibraryKeywords[0]); }

void StatementScanner::feed(std::string_view piece) {
  while (!piece.empty()) {
    if (std::exchange(is_after_cr_, false) && piece.front() == '\n') {
      if (place_ == Place::statement) statement_ += ' ';
      piece.remove_prefix(1);
    } else if (place_ == Place::rest) {
      piece.remove_prefix(take_rest(piece));
    } else {
      take(piece.front());
      piece.remove_prefix(1);
    }
  }
}

/// Passes over what is no statement of ours, to the line's end or the piece's; says how much that is.
std::size_t StatementScanner::take_rest(std::string_view piece) {
  const void* const line_feed = std::memchr(piece.data(), '\n', piece.size());
  if (line_feed) piece = piece.substr(0, static_cast<std::size_t>(static_cast<const char*>(line_feed) - piece.data()));
  const void* const cr = std::memchr(piece.data(), '\r', piece.size());
  if (cr) piece = piece.substr(0, static_cast<std::size_t>(static_cast<const char*>(cr) - piece.data()));
  const std::size_t last = piece.find_last_not_of(" \t");
  if (last != piece.npos) last_ = piece[last];
  if (line_feed || cr) {
    end_line();
    is_after_cr_ = cr != nullptr;
    return piece.size() + 1;
  }
  return piece.size();
}

void StatementScanner::take(char c) {
  if (passed_ < kByteOrderMark.size() && c == kByteOrderMark[passed_]) {
    ++passed_;
    return;
  }
  passed_ = kByteOrderMark.size();
  if (c == '\n' || c == '\r') {
    end_line();
    is_after_cr_ = c == '\r';
    return;
  }
  if (c != ' ' && c != '\t') last_ = c;
  if (place_ == Place::start) {
    const bool may_continue = c == '\\' && !std::exchange(has_backslash_, true);
    if (is_blank(c) || may_continue) return;
    is_comment_ = c == '#' && !is_continued_ && !has_backslash_;
    place_ = has_backslash_ ? Place::rest : Place::statement;
  }
  if (place_ == Place::statement) take_of_statement(c);
}

void StatementScanner::take_of_statement(char c) {
  const std::size_t length = statement_.size();
  const auto goes_on = [&](std::string_view keyword) {
    return length < keyword.size() && keyword[length] == lower_case(c) &&
           equals_in_any_case(statement_, keyword.substr(0, length));
  };
  const bool may_be_ours = is_ours_ ? length < kLongestStatement : std::ranges::any_of(keywords_, goes_on);
  if (!may_be_ours) {
    if (!is_ours_) statement_.clear();
    place_ = Place::rest;
    return;
  }
  statement_ += c;
  is_ours_ |= is_keyword(statement_);
}

void StatementScanner::end_line() {
  const bool continues = last_ == '\\' && !is_comment_;
  last_ = '\0';
  if (!continues) return end_statement();
  is_continued_ = true;
  has_backslash_ = false;
  if (place_ != Place::statement) return;
  statement_[statement_.rfind('\\')] = ' ';
  statement_ += ' ';
}

void StatementScanner::end_statement() {
  const std::size_t end = std::min(statement_.find_first_of(kBlanks), statement_.size());
  const std::string_view keyword = std::string_view(statement_).substr(0, end);
  if (is_keyword(keyword)) tell_(keyword, std::string_view(statement_).substr(end));
  statement_.clear();
  place_ = Place::start;
  is_ours_ = is_comment_ = is_continued_ = has_backslash_ = false;
}

bool StatementScanner::is_keyword(std::string_view word) const {
  return std::ranges::any_of(keywords_, [&](std::string_view keyword) { return equals_in_any_case(word, keyword); });
}

void StatementScanner::finish() { end_statement(); }

bool LibrarySearch::look_for(std::string_view arguments) {
  arguments = trimmed(arguments);
  std::vector<Word> words;
  std::string_view rest = arguments;
  for (Word word; words.size() < kMostNames && next_word(rest, word);) words.push_back(word);
  if (words.empty()) return false;
  if (!words[0].is_quoted && take_as_written(arguments)) return true;

  const auto is_comment = [](const Word& word) { return !word.is_quoted && word.text.starts_with('#'); };
  words.erase(std::find_if(words.begin() + 1, words.end(), is_comment), words.end());
  bool all_found = trimmed(rest).empty();
  const Word* const end = words.data() + words.size();
  for (const Word* word = words.data(); word != end;) {
    const std::size_t taken = take_words(arguments, word, end);
    all_found &= taken > 0;
    word += std::max<std::size_t>(taken, 1);
  }
  return all_found;
}

/// In quotes, or between blanks. A quote that isn't closed before a blank or the end is a character like others.
bool LibrarySearch::next_word(std::string_view& rest, Word& word) {
  rest.remove_prefix(std::min(rest.find_first_not_of(kBlanks), rest.size()));
  if (rest.empty()) return false;
  if (rest[0] == '"' || rest[0] == '\'') {
    const std::size_t end = rest.find(rest[0], 1);
    if (end != rest.npos && end > 1 && (end + 1 == rest.size() || is_blank(rest[end + 1]))) {
      word = {rest.substr(1, end - 1), true};
      rest.remove_prefix(end + 1);
      return true;
    }
  }
  word = {rest.substr(0, rest.find_first_of(kBlanks)), false};
  rest.remove_prefix(word.text.size());
  return true;
}

/// How many words, from the first on, make a library that is there; 0 for none.
std::size_t LibrarySearch::take_words(std::string_view arguments, const Word* begin, const Word* end) {
  if (begin->is_quoted) return take_as_written(begin->text) || take_without_folders(begin->text) ? 1 : 0;
  std::size_t most = 1;
  const auto at_end = [&] { return begin + most == end || begin[most].is_quoted; };
  while (!at_end() && !ends_a_name(begin[most - 1].text) && most < kMostWordsOfName) ++most;

  const auto name_of = [&](std::size_t count) {
    const std::string_view last = begin[count - 1].text;
    const std::size_t from = static_cast<std::size_t>(begin->text.data() - arguments.data());
    return arguments.substr(from, static_cast<std::size_t>(last.data() + last.size() - begin->text.data()));
  };
  for (std::size_t count = most; count > 0; --count)
    if (take_as_written(name_of(count))) return count;
  for (std::size_t count = most; count > 0; --count)
    if (take_without_folders(name_of(count))) return count;
  return 0;
}

bool LibrarySearch::take_as_written(std::string_view name) {
  const std::string path = with_slashes(name);
  // The plain form first, so that a library that is named in two ways is taken once.
  return names_.take(std::filesystem::path(path).lexically_normal().generic_string()) || names_.take(path) ||
         names_.take(std::string(name));
}

bool LibrarySearch::take_without_folders(std::string_view name) {
  const std::string path = with_slashes(name);
  return names_.take(path.substr(path.rfind('/') + 1));  // npos + 1 is 0.
}

bool AskedNames::take(const std::string& name) {
  if (name.empty() || name.size() > kLongestName) return false;
  const auto known = asked_.find(name);
  if (known != asked_.end()) return known->second;
  if (asked_.size() >= most_) return false;
  return asked_[name] = take_(name);
}

}  // namespace tessera::proto
