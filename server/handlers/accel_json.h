#pragma once

#include <nlohmann/json_fwd.hpp>

#include "core/scene/accel_options.h"

namespace tessera::server {

/// The options that the kind reads, each with its value; beside "kind" they make an accel as job documents have it.
/// None for `automatic`.
nlohmann::json accel_options_json(const AccelOptions& options);

/// Every structure with its options, their ranges and defaults, straight from the tables that make them.
nlohmann::json accel_capabilities_json();

}  // namespace tessera::server
