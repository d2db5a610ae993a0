#pragma once

#include <cstdint>
#include <filesystem>
#include <stop_token>
#include <string>
#include <string_view>

namespace tessera::proto {

/// A whole file's bytes. Throws `BrokenFile` with `name` when it can't be read or is larger than `limit`,
/// `Abandoned` when a stop is requested before its end.
std::string read_file(const std::filesystem::path& path, std::string_view name, std::uintmax_t limit,
                      const std::stop_token& stop = {});

}  // namespace tessera::proto
