#pragma once

#include "core/scene/scene.h"

namespace tessera {

/// A camera for a scene that has none: looks along −z with y up, a little from above and from the right, at the
/// centre of the scene's box, far enough that all of it is in a square image. A unit cube at the origin stands in
/// for an empty scene.
Camera frame_scene(const Scene& scene);

}  // namespace tessera
