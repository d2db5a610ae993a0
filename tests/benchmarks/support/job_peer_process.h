#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tessera::bench {

/// Runs a program to its end, its output going to a file; wall seconds. The first word is the program, looked for
/// in the PATH. Throws std::runtime_error when it doesn't end well.
double seconds_to_run(const std::vector<std::string>& command, const std::filesystem::path& output);

/// Where the PATH has such a program.
bool is_installed(const std::string& program);

}  // namespace tessera::bench
