#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/math/ray.h"
#include "core/scene/scene.h"

namespace tessera::bench {

/// A scene that is hard on rounding, small enough for an oracle that tests everything, and rays through it.
struct ErrorScene {
  std::string name;
  std::string what;  ///< A few words.
  std::shared_ptr<const Scene> scene;
  std::vector<Ray> rays;
};

std::vector<ErrorScene> error_scenes();

}  // namespace tessera::bench
