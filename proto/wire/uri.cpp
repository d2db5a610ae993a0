#include "proto/wire/uri.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>

namespace tessera::proto {
namespace {

constexpr std::string_view kData = "data:";
constexpr std::uint8_t kNone = 255;

constexpr std::array<std::uint8_t, 256> base64_digits() {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::array<std::uint8_t, 256> table{};
  table.fill(kNone);
  for (std::size_t i = 0; i < kDigits.size(); ++i)
    table[static_cast<unsigned char>(kDigits[i])] = static_cast<std::uint8_t>(i);
  return table;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/// A '%' that isn't followed by two digits stands for itself.
std::string without_escapes(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool is_escape =
        text[i] == '%' && i + 2 < text.size() && hex_digit(text[i + 1]) >= 0 && hex_digit(text[i + 2]) >= 0;
    plain += is_escape ? static_cast<char>(hex_digit(text[i + 1]) * 16 + hex_digit(text[i + 2])) : text[i];
    if (is_escape) i += 2;
  }
  return plain;
}

/// RFC 4648, section 4; the '=' at the end may be left out. What is wrong; empty when all is well.
std::string read_base64(std::string_view text, std::string& out) {
  static constexpr std::array<std::uint8_t, 256> kDigit = base64_digits();
  const std::size_t whole = text.size();
  for (int i = 0; i < 2 && whole % 4 == 0 && text.ends_with('='); ++i) text.remove_suffix(1);
  if (text.size() % 4 == 1) return "its base64 is cut off";
  out.resize(text.size() / 4 * 3 + (text.size() % 4 == 0 ? 0 : text.size() % 4 - 1));
  std::size_t filled = 0;
  for (std::size_t at = 0; at < text.size(); at += 4) {
    std::uint32_t bits = 0;
    const std::size_t digits = std::min<std::size_t>(4, text.size() - at);
    for (std::size_t i = 0; i < digits; ++i) {
      const std::uint8_t digit = kDigit[static_cast<unsigned char>(text[at + i])];
      if (digit == kNone) return "its base64 has a bad character at position " + std::to_string(at + i);
      bits |= std::uint32_t{digit} << (18 - 6 * i);
    }
    for (std::size_t i = 0; i + 1 < digits; ++i) out[filled++] = static_cast<char>(bits >> (16 - 8 * i) & 255);
  }
  return "";
}

}  // namespace

bool is_data_uri(std::string_view uri) {
  return uri.size() >= kData.size() && std::equal(kData.begin(), kData.end(), uri.begin(), [](char a, char b) {
           return a == (b >= 'A' && b <= 'Z' ? b - 'A' + 'a' : b);
         });
}

std::variant<DataUri, std::string> read_data_uri(std::string_view uri) {
  uri.remove_prefix(kData.size());
  const std::size_t comma = uri.find(',');
  if (comma == uri.npos) return "it has no comma before its data";
  std::string_view header = uri.substr(0, comma), data = uri.substr(comma + 1);

  DataUri read;
  read.media_type = header.substr(0, header.find(';'));
  header.remove_prefix(read.media_type.size());
  bool is_base64 = false;
  while (!header.empty()) {
    header.remove_prefix(1);  // the semicolon
    const std::string_view parameter = header.substr(0, header.find(';'));
    header.remove_prefix(parameter.size());
    is_base64 = header.empty() && parameter == "base64";
    if (!is_base64 && parameter.find('=') == parameter.npos) return "it has a parameter without a value";
  }
  if (!is_base64) {
    read.bytes = without_escapes(data);
    return read;
  }
  if (std::string why = read_base64(data, read.bytes); !why.empty()) return why;
  return read;
}

CompanionName read_relative_uri(std::string_view uri) {
  const auto refused = [](std::string why) { return CompanionName{{}, std::move(why)}; };
  if (uri.empty()) return refused("it is empty");
  const std::size_t colon = uri.find(':');
  if (colon < uri.find_first_of("/?#")) {
    return refused("it isn't relative, and nothing is fetched: files come beside this one or with it");
  }
  CompanionName companion{without_escapes(uri), {}};
  if (companion.name.find('\0') != std::string::npos) return refused("it holds a NUL byte");
  const std::filesystem::path path = std::filesystem::path(companion.name).lexically_normal();
  if (path.is_absolute()) return refused("it is an absolute path");
  if (path.begin() != path.end() && *path.begin() == "..") return refused("it leads out of the file's folder");
  companion.name = path.generic_string();
  return companion;
}

}  // namespace tessera::proto
