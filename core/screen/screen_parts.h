#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/bounds/pixel_rect.h"
#include "core/scene/scene.h"
#include "core/screen/camera_rays.h"

namespace tessera {

/// The pixels whose samples may see something of a part of an object.
struct ScreenPart {
  PixelRect area;
  std::uint32_t object = 0;
};

/// At most about this many parts beside one for each object, whatever the scene: projecting them takes some
/// milliseconds.
inline constexpr std::uint32_t kMostParts = 1 << 15;

/// Where the parts of every object may be seen, empty areas left out, object by object: together its parts hold all of
/// its primitives, and they lie within its own area of `areas` (one for each object, by `screen_rect`). An object is
/// one part unless it is a mesh with an area of more than `smallest` pixels on a side. Such meshes share kMostParts
/// evenly, and each is divided by a grid of cubes over its own box: as many as its share allows, but with 8 triangles
/// or more in the average one of a closed mesh. The triangles whose boxes' centres lie in a cube are a part.
std::vector<ScreenPart> screen_parts(const Scene& scene, const CameraRays& camera, std::span<const PixelRect> areas,
                                     std::int32_t smallest);

}  // namespace tessera
