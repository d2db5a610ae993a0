#pragma once

#include <memory>

#include "core/scene/light.h"

namespace tessera {

/// A photographer's studio, as an environment: soft boxes around a grey room that has its front towards +z. White that
/// faces the front is about as bright as white can be shown. Always the same map; made by the first call.
std::shared_ptr<const EnvironmentMap> studio_environment();

}  // namespace tessera
