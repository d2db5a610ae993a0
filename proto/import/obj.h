#pragma once

#include <stop_token>
#include <string>
#include <string_view>

#include "proto/import/import.h"

namespace tessera::proto {

/// Reads of an OBJ file v, vt, vn, f, s, o, g, usemtl and mtllib. Throws `BrokenFile`, with up to `kMaxFieldErrors`
/// errors, when the file has faces and none of them can be used, or is no text.
///
/// - Each object, group and material makes a mesh, in the order of first faces. Its normals are those that corners
/// name;
///   where they name none, the faces of a smoothing group share one at each position, other faces are flat.
/// - Faces whose corners aren't written as such, or that name vertices that aren't there, are dropped; an index of a
///   normal or texture coordinate that isn't there counts as none; a vertex whose numbers are no numbers keeps its
///   place and costs its faces. All of it, and statements that have no meaning here, is counted in warnings.
/// - Texture coordinates are those of meshes whose material has textures. Colours behind positions, r g b up to 1 or to
///   255, are display values (sRGB), as programs that paint and scan write them; they tint the mesh's material.
/// - A missing MTL library, or a material that none has, is a warning; the mesh then has no material.
/// - Nothing of the text is quoted until it has given a face: it may be any file.
Imported import_obj(std::string text, std::string_view file_name, const CompanionSource& companions,
                    std::stop_token stop = {}, std::uint64_t texture_bytes = 1ULL << 30);

}  // namespace tessera::proto
