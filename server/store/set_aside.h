#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace tessera::server {

/// Moves a damaged file into `folder`, which is made if it is missing, under the name of the folder that it was in and
/// its own ("blobs-<hash>"), with a number behind it where that is taken: nothing there is ever overwritten. Where
/// `folder` is on another file system, it goes into one of the same name beside it. Logs what is wrong (`why`: "its
/// content isn't what it was") and where the file is from now on, and counts it. Returns that place; nothing when the
/// file had gone. Throws std::system_error when it can't be moved. For any thread.
std::filesystem::path set_aside(const std::filesystem::path& damaged, const std::filesystem::path& folder,
                                std::string_view why);

/// How many files this process has set aside.
std::uint64_t files_set_aside();

}  // namespace tessera::server
