#pragma once

#include <optional>
#include <string_view>

#include "core/scene/camera.h"
#include "proto/wire/sha256.h"

namespace tessera::server {

/// A glTF file but for where its camera stands.
struct DrakeView {
  proto::ContentHash rest;  ///< Of all that is written but the matrix of the camera's node: of what is looked at.
  View view;                ///< That the importer makes of the matrix.
};

/// Looks for the camera as Drake writes it: the only one of the file, in a node that has a matrix, no parent and
/// nothing else that the matrix moves. So that what a robot sees from one place after the other is known from the
/// second one on, though each comes in a file of its own. Nothing for other files, which are taken as they are.
std::optional<DrakeView> find_drake_view(std::string_view gltf);

}  // namespace tessera::server
