#pragma once

#include <cstdint>

#include "core/scene/scene.h"

namespace tessera {

/// `camera` where it is placed. Otherwise it is placed for an image of that size: its direction, `up` and field of view
/// stay as they are, and all that there is to see is in the image, up to a margin of 4% of the smaller side (a pixel
/// at least, where that leaves room), which it touches on two opposite sides. A unit cube at the origin stands in for
/// an empty scene, a unit ball for a single point. Sizes are at least 1.
///
/// By default it looks along −z with y up, a little from above and from the right.
Camera frame_scene(const Scene& scene, std::uint32_t width, std::uint32_t height, Camera camera = kUnplacedCamera);

}  // namespace tessera
