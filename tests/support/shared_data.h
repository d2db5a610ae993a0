#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <system_error>

namespace tessera {

/// The folder of test data that isn't part of the project (its licences differ): $TESSERA_SHARED_DATA, or
/// ../shared/data beside the checkout. Nothing when it is missing: a test that wants it then skips, and says so.
inline std::optional<std::filesystem::path> shared_data() {
  const char* from_environment = std::getenv("TESSERA_SHARED_DATA");
  const std::filesystem::path folder = from_environment != nullptr && *from_environment != '\0'
                                           ? std::filesystem::path(from_environment)
                                           : std::filesystem::path(TESSERA_SOURCE_DIR).parent_path() / "shared/data";
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) return std::nullopt;
  return folder;
}

}  // namespace tessera
