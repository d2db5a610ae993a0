#pragma once

#include <stop_token>
#include <string_view>

#include "proto/import/import.h"

namespace tessera::proto {

/// Reads the whole of Haines' Neutral File Format 3.1 (v b l f c s p pp #). Throws `BrokenFile`.
///
/// - NFF predates linear light: its numbers were chosen for what they show on a display. So the background, a fill's
///   colour times Kd, Ks and T are each decoded from sRGB, and a term alone looks as its author saw it. Ks is white;
///   T > 0 lets a surface reflect 1 − T when Ks is 0. Entities before the first fill have no material. No ambient
///   light.
/// - A light without a colour has irradiance π/√n at every distance, n being the number of lights; one with a colour
///   π times that.
/// - `angle` spans the centres of the outer rows of pixels, so the field of view is wider by half a pixel at both
///   ends of the file's own `resolution`, which is the image's size. `hither` is ignored: Haines has it for
///   hidden-surface algorithms.
/// - Neighbouring p and pp entities make one mesh, with normals if one of them is pp; flat ones then get their
///   face's. A negative radius, meant to show a surface's inside alone, counts as positive.
/// - Errors quote nothing of the text: NFF has no mark to be known by, and it may be any file.
Imported import_nff(std::string_view text, std::string_view file_name, std::stop_token stop = {});

}  // namespace tessera::proto
