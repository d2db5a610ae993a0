#include "proto/import/environment.h"

namespace tessera::proto {

Result<std::shared_ptr<const EnvironmentMap>> import_environment(const std::filesystem::path&, std::string_view,
                                                                 std::uint64_t, std::stop_token) {
  return Problem{ProblemCode::invalid_document, "Environments' maps can't be read yet.", {}};
}

}  // namespace tessera::proto
