#pragma once

#include <string_view>

namespace tessera::server {

/// The documents of proto/ that the daemon serves, built into it (server/CMakeLists.txt).
extern const std::string_view kOpenApiDocument;
extern const std::string_view kSceneSchema;
extern const std::string_view kJobSchema;

}  // namespace tessera::server
