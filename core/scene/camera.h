#pragma once

#include <numbers>
#include <variant>

#include "core/math/unit_vec3.h"

namespace tessera {

/// Where a camera stands. `at` − `from` and `up` are finite, not zero and not parallel.
struct View {
  Vec3 from;
  Vec3 at;
  Vec3 up{0, 1, 0};
  bool is_placed = true;  ///< Otherwise only the direction from `from` to `at` counts: see `frame_scene`.
};

/// A pinhole. Pixels are square.
struct PerspectiveCamera {
  View view;
  float vertical_fov =
      std::numbers::pi_v<float> / 4;  ///< Radians from the image's top edge to its bottom edge; in (0, π).
};

/// Parallel rays from the plane through `from` that faces `at`. Pixels are square.
struct OrthographicCamera {
  View view;
  float height = 1;  ///< Metres from the image's top edge to its bottom edge; > 0. Means nothing unless placed.
};

using Camera = std::variant<PerspectiveCamera, OrthographicCamera>;

/// The view of a camera that says nothing of its own: along −z, a little from above and from the right.
inline constexpr View kUnplacedView{{0.4F, 0.35F, 1}, {0, 0, 0}, {0, 1, 0}, false};
inline constexpr PerspectiveCamera kUnplacedCamera{kUnplacedView};

}  // namespace tessera
