#pragma once

#include <string>
#include <string_view>

namespace tessera::proto {

/// `text`, in which a '?' stands for whatever acts on a terminal or hides there, and for every byte that isn't part of
/// valid UTF-8 (RFC 3629): control characters of both blocks (C0, DEL and C1), separators of lines and paragraphs,
/// what turns the direction of writing (Unicode Technical Report 36), and what takes no room. The joiners stay, which
/// words of some scripts need. For all that others named, on its way into JSON, a log or a terminal.
std::string printable(std::string_view text);

/// Whether all of it is valid UTF-8 (RFC 3629).
bool is_utf8(std::string_view text);

}  // namespace tessera::proto
