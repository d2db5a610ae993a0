#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/scene/camera.h"
#include "core/scene/light.h"
#include "proto/import/gltf/nodes.h"

namespace tessera::proto {

/// KHR_lights_punctual: the document's lights, at the origin, shining along −z.
std::vector<Light> read_lights(GltfFile& file);

/// A light where a node puts it: its place and direction count, its scale doesn't. Nothing where that leaves it none.
std::optional<Light> placed(const Light& light, const Rows& to_world);

/// A camera of the document, at the origin, looking along −z.
struct GltfCamera {
  Camera camera;
  std::string name;
};
std::vector<GltfCamera> read_cameras(GltfFile& file);

/// A camera where a node puts it; nothing where that leaves it no direction.
std::optional<Camera> placed(const Camera& camera, const Rows& to_world);

}  // namespace tessera::proto
