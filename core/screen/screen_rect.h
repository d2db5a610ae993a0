#pragma once

#include "core/bounds/aabb.h"
#include "core/bounds/pixel_rect.h"
#include "core/math/transform.h"
#include "core/screen/camera_rays.h"

namespace tessera {

/// The pixels whose samples may see something of `box`: never too few. A box wholly behind the camera has none; one
/// that the camera is in, or that straddles the camera's plane, is cut at that plane, its far side reaching to the
/// picture's edge where it must. All of the lens may see it, and all that the camera's `beyond` lets samples reach;
/// clipping doesn't make it smaller. `placed` bounds the rounding of the instances in the box.
PixelRect screen_rect(const Aabb& box, const CameraRays& camera, Transform::Error placed = {});

}  // namespace tessera
