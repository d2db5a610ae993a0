#pragma once

#include <string>

#include "server/services.h"

namespace tessera::server {

/// All metrics as Prometheus reads them (text format 0.0.4): what `metrics()` has counted, and what the services have
/// at the moment. Names begin with tessera_, or process_ as every exporter has them; units are seconds and bytes;
/// labels have few values, all of this program's: never an id, a hash or what a client sent.
std::string exposition(Services& services);

inline constexpr const char* kExpositionType = "text/plain; version=0.0.4; charset=utf-8";

}  // namespace tessera::server
