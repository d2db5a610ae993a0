#include "proto/import/gltf/draco.h"

namespace tessera::proto {

std::optional<GltfTriangles> read_draco(const Primitive& primitive, const Accessors&, GltfBuffers&, GltfFile&) {
  primitive.where.error("Not yet.");
  return std::nullopt;
}

}  // namespace tessera::proto
