#pragma once

#include <string>
#include <string_view>

#include "proto/import/import.h"

namespace tessera::proto {

/// Reads of an OBJ file v, vn, f, o, g, usemtl and mtllib. Throws `BrokenFile`, with up to `kMaxFieldErrors` errors.
///
/// - Each object, group and material makes a mesh, in the order of first faces, with normals where every corner
///   has one. Smoothing groups and texture coordinates are ignored, but that corners name coordinates which are there
///   is checked; other statements are counted in a warning.
/// - A missing MTL library, or a material that none has, is a warning; the mesh then has no material. Colours are
///   linear. `d` is opacity: what a surface doesn't stop goes through, bent by Ni in the illumination models with
///   refraction (4 to 7 and above 8); 3 to 7 mirror with Ks, 5 and 7 by Fresnel's equations.
Imported import_obj(std::string text, std::string_view file_name, const CompanionSource& companions);

}  // namespace tessera::proto
