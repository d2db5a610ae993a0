#pragma once

#include <span>
#include <vector>

#include "proto/import/obj_part.h"

namespace tessera::proto {

/// Gives normals to the corners of OBJ faces that name none, and appends these to `normals`; all indices must be in
/// range. Where faces of one smoothing group share a position they share its normal, the mean of theirs weighted by
/// area (Gouraud 1971), whatever their object, group and material. A face without a smoothing group has its own normal
/// where its mesh has others, and none, which is flat shading, where not.
void complete_normals(std::span<ObjFaces* const> meshes, const std::vector<Vec3>& positions, std::vector<Vec3>& normals,
                      Steps& steps);

}  // namespace tessera::proto
