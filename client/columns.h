#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace tessera::client {

/// How many columns of a terminal a line of UTF-8 takes: two for the wide characters of East Asia and for emoji, none
/// for marks that stand on others (Unicode Standard Annex 11, by blocks).
std::size_t columns_of(std::string_view line);

/// `text`, with blanks behind up to `columns`.
std::string padded(std::string_view text, std::size_t columns);

/// `text`, with blanks before it.
std::string flush_right(std::string_view text, std::size_t columns);

}  // namespace tessera::client
