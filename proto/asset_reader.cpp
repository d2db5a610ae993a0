#include "proto/asset_reader.h"

#include "proto/import/environment.h"

namespace tessera::proto {
namespace {

class DirectReader final : public AssetReader {
 public:
  Result<Imported> import(const std::filesystem::path& path, FileFormat format, std::string_view display_name,
                          const CompanionSource& companions, const std::stop_token& stop, const ImportOptions& options,
                          std::uint64_t texture_bytes) const override {
    return import_file(path, format, display_name, companions, stop, options, texture_bytes);
  }

  Result<std::shared_ptr<const EnvironmentMap>> environment(const std::filesystem::path& path,
                                                            std::string_view display_name, std::uint64_t max_bytes,
                                                            const std::stop_token& stop) const override {
    return import_environment(path, display_name, max_bytes, stop);
  }
};

}  // namespace

const AssetReader& direct_reader() {
  static const DirectReader reader;
  return reader;
}

}  // namespace tessera::proto
