#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace tessera::proto {

/// A whole file's bytes. Throws `BrokenFile` with `name` when it can't be read or is larger than `limit`.
std::string read_file(const std::filesystem::path& path, std::string_view name, std::uintmax_t limit);

}  // namespace tessera::proto
