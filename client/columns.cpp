#include "client/columns.h"

#include <algorithm>

namespace tessera::client {
namespace {

struct Range {
  char32_t first, last;
};

constexpr Range kMarks[] = {
    {0x0300, 0x036F}, {0x0483, 0x0489}, {0x0591, 0x05BD}, {0x0610, 0x061A}, {0x064B, 0x065F},
    {0x0900, 0x0902}, {0x093C, 0x093C}, {0x0941, 0x0948}, {0x094D, 0x094D}, {0x0E31, 0x0E31},
    {0x0E34, 0x0E3A}, {0x0E47, 0x0E4E}, {0x1AB0, 0x1AFF}, {0x1DC0, 0x1DFF}, {0x200C, 0x200D},
    {0x20D0, 0x20FF}, {0x3099, 0x309A}, {0xFE00, 0xFE0F}, {0xFE20, 0xFE2F},
};

constexpr Range kWide[] = {
    {0x1100, 0x115F},   {0x2E80, 0x303E},   {0x3041, 0xA4CF},   {0xA960, 0xA97C}, {0xAC00, 0xD7A3},
    {0xF900, 0xFAFF},   {0xFE30, 0xFE6F},   {0xFF00, 0xFF60},   {0xFFE0, 0xFFE6}, {0x1F300, 0x1F64F},
    {0x1F680, 0x1F6FF}, {0x1F900, 0x1FAFF}, {0x20000, 0x3FFFD},
};

template <std::size_t n>
bool is_in(char32_t character, const Range (&ranges)[n]) {
  return std::ranges::any_of(ranges, [&](Range r) { return r.first <= character && character <= r.last; });
}

std::string blanks(std::string_view text, std::size_t columns) {
  return std::string(columns - std::min(columns, columns_of(text)), ' ');
}

}  // namespace

std::size_t columns_of(std::string_view line) {
  std::size_t columns = 0;
  for (std::size_t at = 0; at < line.size();) {
    const auto lead = static_cast<unsigned char>(line[at++]);
    char32_t character = lead < 0xC0 ? lead : lead < 0xE0 ? lead & 0x1FU : lead < 0xF0 ? lead & 0x0FU : lead & 0x07U;
    for (; at < line.size() && (line[at] & 0xC0) == 0x80; ++at) character = character << 6 | (line[at] & 0x3FU);
    if (!is_in(character, kMarks)) columns += is_in(character, kWide) ? 2 : 1;
  }
  return columns;
}

std::string padded(std::string_view text, std::size_t columns) { return std::string(text) + blanks(text, columns); }

std::string flush_right(std::string_view text, std::size_t columns) {
  return blanks(text, columns) + std::string(text);
}

}  // namespace tessera::client
