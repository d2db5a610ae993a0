#include "proto/wire/material_textures.h"

#include <algorithm>
#include <filesystem>
#include <iterator>

namespace tessera::proto {
namespace {

constexpr std::string_view kBlanks = " \t\v\f\r\n";

struct KnownOption {
  std::string_view name;
  std::size_t most;  ///< Values.
  bool are_numbers;
};
constexpr KnownOption kOptions[] = {
    {"-blendu", 1, false}, {"-blendv", 1, false},  {"-bm", 1, true},    {"-boost", 1, true},      {"-cc", 1, false},
    {"-clamp", 1, false},  {"-imfchan", 1, false}, {"-mm", 2, true},    {"-o", 3, true},          {"-s", 3, true},
    {"-t", 3, true},       {"-texres", 1, true},   {"-type", 1, false}, {"-colorspace", 1, false}};

bool may_be_number(std::string_view word) {
  return word.find_first_not_of("+-.0123456789eE") == word.npos && word.find_first_of("0123456789") != word.npos;
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
    if (text.empty()) return words;
    words.push_back(text.substr(0, text.find_first_of(kBlanks)));
    text.remove_prefix(words.back().size());
  }
}

/// Without quotes around it.
std::string_view unquoted(std::string_view name) {
  const bool is_quoted = name.size() > 1 && (name[0] == '"' || name[0] == '\'') && name.back() == name[0];
  return is_quoted ? name.substr(1, name.size() - 2) : name;
}

/// Up to where a comment may begin; nothing when there is none.
std::optional<std::string_view> before_comment(std::string_view name) {
  for (std::size_t at = name.find('#'); at != name.npos; at = name.find('#', at + 1)) {
    if (at == 0 || kBlanks.find(name[at - 1]) == kBlanks.npos) continue;
    return name.substr(0, name.find_last_not_of(kBlanks, at - 1) + 1);
  }
  return std::nullopt;
}

std::string normal(const std::filesystem::path& path) { return path.lexically_normal().generic_string(); }

}  // namespace

TextureStatement split_texture_statement(std::string_view arguments) {
  TextureStatement statement;
  const std::vector<std::string_view> words = words_of(arguments);
  bool name_ended = false;
  for (std::size_t i = 0; i < words.size();) {
    const auto* const known = std::ranges::find(kOptions, words[i], &KnownOption::name);
    if (known == std::end(kOptions)) {
      if (statement.file.empty()) statement.file = words[i];
      const char* const end = words[i].data() + words[i].size();
      if (!name_ended) statement.file = {statement.file.data(), static_cast<std::size_t>(end - statement.file.data())};
      ++i;
      continue;
    }
    name_ended = !statement.file.empty();
    TextureStatement::Option& option = statement.options.emplace_back(TextureStatement::Option{words[i++], {}});
    // Of what comes before it, the name needs a word.
    const std::size_t left = words.size() - std::min(words.size(), name_ended ? i : i + 1);
    for (std::size_t n = 0; n < std::min(known->most, left); ++n) {
      if (known->are_numbers && !may_be_number(words[i])) break;
      option.values.push_back(words[i++]);
    }
  }
  return statement;
}

std::string_view ply_texture_file(std::string_view line) {
  const std::vector<std::string_view> words = words_of(line);
  if (words.size() < 3 || words[0] != "comment" || words[1] != "TextureFile") return {};
  const char* const end = words.back().data() + words.back().size();
  return {words[2].data(), static_cast<std::size_t>(end - words[2].data())};
}

std::optional<std::string> TextureSearch::look_for(std::string_view library, std::string_view file) {
  if (file.empty()) return std::nullopt;
  std::vector<std::string> written{with_slashes(unquoted(file))};
  if (const auto name = before_comment(file)) written.push_back(with_slashes(unquoted(*name)));
  const std::filesystem::path folder = std::filesystem::path(with_slashes(library)).parent_path();

  std::vector<std::string> names;
  for (const std::string& name : written) names.push_back(normal(folder / name));
  for (const std::string& name : written) names.push_back(normal(name));
  for (const std::string& name : written) names.push_back(normal(folder / name.substr(name.rfind('/') + 1)));
  names.emplace_back(file);  // as a sender may have named it
  for (std::string& name : names)
    if (names_.take(name)) return std::move(name);
  return std::nullopt;
}

}  // namespace tessera::proto
