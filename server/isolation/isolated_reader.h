#pragma once

#include <chrono>
#include <cstdint>

#include "proto/asset_reader.h"
#include "server/isolation/isolation.h"

namespace tessera::server {

/// Reads files in processes of their own, and decodes their images so, when they are first asked for. What makes such a
/// process crash, hang or take too much memory is `invalid_document`, as what is broken otherwise is; an image is white
/// then. Where there can be no process, `reader_unavailable`. Safe to use from any number of threads.
class IsolatedReader final : public proto::AssetReader {
 public:
  /// `isolation` does `read_in_worker`, and lives as long as this and all that it has read. A file may take so many
  /// seconds.
  IsolatedReader(const Isolation& isolation, std::uint32_t seconds) : isolation_(isolation), seconds_(seconds) {}

  proto::Result<proto::Imported> import(const std::filesystem::path& path, proto::FileFormat format,
                                        std::string_view display_name, const proto::CompanionSource& companions,
                                        const std::stop_token& stop, const proto::ImportOptions& options,
                                        std::uint64_t texture_bytes) const override;

  proto::Result<std::shared_ptr<const EnvironmentMap>> environment(const std::filesystem::path& path,
                                                                   std::string_view display_name,
                                                                   std::uint64_t max_bytes,
                                                                   const std::stop_token& stop) const override;

 private:
  const Isolation& isolation_;
  const std::uint32_t seconds_;
};

}  // namespace tessera::server
