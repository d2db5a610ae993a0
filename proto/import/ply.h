#pragma once

#include <stop_token>
#include <string_view>

#include "proto/import/import.h"

namespace tessera::proto {

/// Reads a PLY file of any encoding into one mesh (none when it has no triangles). Throws `BrokenFile`.
///
/// Read are x y z and nx ny nz of "vertex"; its s t (or u v, texture_u texture_v), or else the lists texcoord of
/// "face", where a comment "TextureFile" names an image that is there, which is then the colour of a white material;
/// else its red green blue (or diffuse_red ..., r g b) and alpha, which are display values (sRGB), whole numbers up to
/// 255 or 65535 or floats up to 1 or 255, and tint a white material. Without either there is no material. Of "face" and
/// "tristrips" are read the lists vertex_indices (or vertex_index; polygons of any size, and strips as Stanford's:
/// every other triangle turned over, −1 starts a new strip). Elements and properties beside these are skipped and named
/// in a warning. Faces, and triangles of strips, that name vertices which aren't there are dropped and counted; a file
/// with faces of which none can be used is refused.
Imported import_ply(std::string_view bytes, std::string_view file_name, const CompanionSource& companions = nullptr,
                    std::stop_token stop = {}, std::uint64_t texture_bytes = 1ULL << 30);

}  // namespace tessera::proto
