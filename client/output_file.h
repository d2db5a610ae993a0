#pragma once

#include <filesystem>
#include <string_view>
#include <system_error>

namespace tessera::client {

/// Fails now rather than after a long wait when a file can't be written there. Throws `Failure` (local_file).
void expect_writable(const std::filesystem::path& path);

/// Writes a whole file or, on failure, leaves whatever stood there. A device or pipe is written to directly.
/// Throws `Failure` (local_file).
void write_atomically(const std::filesystem::path& path, std::string_view bytes);

/// Writes all of `bytes` to stdout; says what went wrong.
std::error_code write_to_stdout(std::string_view bytes);

}  // namespace tessera::client
