#pragma once

#include <string>
#include <string_view>

namespace tessera::proto {

/// `text`, in which a '?' stands for every control character and every byte that isn't part of valid UTF-8
/// (RFC 3629): what files hold goes into JSON.
std::string printable(std::string_view text);

}  // namespace tessera::proto
