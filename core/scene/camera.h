#pragma once

#include <numbers>
#include <optional>
#include <variant>

#include "core/math/rounding.h"
#include "core/math/unit_vec3.h"

namespace tessera {

/// Where a camera stands. `at` − `from` and `up` are finite, not zero and not parallel.
struct View {
  Vec3 from;
  Vec3 at;
  Vec3 up{0, 1, 0};
  bool is_placed = true;  ///< Otherwise only the direction from `from` to `at` counts: see `frame_scene`.
};

/// What a camera sees of what is before it: strictly between two planes across its axis, in metres from it;
/// 0 ≤ near < far.
struct Clipping {
  float near = 0, far = kInfinity;
};

/// A calibrated camera's: focal lengths and the point where the axis meets the image, in pixels, (0, 0) being the top
/// left corner of the top left pixel. fx, fy > 0; cx, cy may lie outside the image.
struct Intrinsics {
  float fx = 1, fy = 1, cx = 0, cy = 0;
};

/// A thin lens: a disk about the camera's position, across its axis. What lies `focus_distance` metres along the axis
/// (> 0) is sharp.
struct Lens {
  float radius = 0;  ///< Metres; 0 is a pinhole.
  float focus_distance = 1;
};

/// A camera that sees from a point, or through a lens. Pixels are square unless `intrinsics` say otherwise.
struct PerspectiveCamera {
  View view;
  float vertical_fov =
      std::numbers::pi_v<float> / 4;  ///< Radians from the image's top edge to its bottom edge; in (0, π).
  std::optional<Intrinsics> intrinsics = std::nullopt;  ///< In place of the field of view.
  Lens lens = {};
  Clipping clipping = {};
};

/// Parallel rays from the plane through `from` that faces `at`. Pixels are square.
struct OrthographicCamera {
  View view;
  float height = 1;  ///< Metres from the image's top edge to its bottom edge; > 0. Means nothing unless placed.
  Clipping clipping = {};
};

using Camera = std::variant<PerspectiveCamera, OrthographicCamera>;

/// The view of a camera that says nothing of its own: along −z, a little from above and from the right.
inline constexpr View kUnplacedView{{0.4F, 0.35F, 1}, {0, 0, 0}, {0, 1, 0}, false};
inline constexpr PerspectiveCamera kUnplacedCamera{kUnplacedView};

}  // namespace tessera
