#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string_view>

#include "core/scene/light.h"
#include "proto/import/import.h"
#include "proto/wire/result.h"

namespace tessera::proto {

/// Reads the files that scenes name: where, is up to it. Safe to use from any number of threads.
class AssetReader {
 public:
  virtual ~AssetReader() = default;

  /// As `import_file`; and throws what `companions` throws.
  virtual Result<Imported> import(const std::filesystem::path& path, FileFormat format, std::string_view display_name,
                                  const CompanionSource& companions, const std::stop_token& stop,
                                  const ImportOptions& options, std::uint64_t texture_bytes) const = 0;

  /// As `import_environment`.
  virtual Result<std::shared_ptr<const EnvironmentMap>> environment(const std::filesystem::path& path,
                                                                    std::string_view display_name,
                                                                    std::uint64_t max_bytes,
                                                                    const std::stop_token& stop) const = 0;
};

/// Reads them in this process: a file that makes a library crash ends it.
const AssetReader& direct_reader();

}  // namespace tessera::proto
