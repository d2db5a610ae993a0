#pragma once

#include <variant>

#include "core/math/unit_vec3.h"

namespace tessera {

/// Where a camera stands. `at` − `from` and `up` are finite, not zero and not parallel.
struct View {
  Vec3 from;
  Vec3 at;
  Vec3 up{0, 1, 0};
};

/// A pinhole. Pixels are square.
struct PerspectiveCamera {
  View view;
  float vertical_fov = 0.7854F;  ///< Radians from the image's top edge to its bottom edge; in (0, π).
};

/// Parallel rays from the plane through `from` that faces `at`. Pixels are square.
struct OrthographicCamera {
  View view;
  float height = 1;  ///< Metres from the image's top edge to its bottom edge; > 0.
};

using Camera = std::variant<PerspectiveCamera, OrthographicCamera>;

}  // namespace tessera
