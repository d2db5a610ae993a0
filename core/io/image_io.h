#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/film/film.h"
#include "core/io/image_format.h"

namespace tessera {

/// Which plane of the film to encode. `all` writes colour and every recorded AOV as channels of one EXR.
enum class Plane { color, depth, normal, primitive_id, object_id, cost_volumes, cost_primitives, all };

/// Encodes to memory: PNG through libpng, the others through OpenImageIO, which the first of them loads.
///
/// PNG and JPEG hold 8 bits of display values: colour is clamped to 0..1 and given sRGB's transfer curve; depth is
/// scaled from nearest (white) to farthest (black) finite value; normals map −1..1 to 0..255; ids become distinct
/// hues; costs a heat map (`heat_color`) from 0 to the greatest cost of the image. EXR holds the linear floats
/// themselves, channels "R" "G" "B", "Z", "N.X" "N.Y" "N.Z", "cost.volumes", "cost.primitives", and the ids as
/// unsigned "primitiveId" and "objectId". HDR holds colour, normals and costs (as grey) as RGBE.
///
/// `done`, one byte a pixel, becomes the alpha channel of PNG and EXR where given.
/// Nothing when the film doesn't hold the plane, when `hdr` is asked for depth, ids or `all`, when PNG
/// or JPEG is asked for `all`, or when the encoder fails. Throws std::runtime_error when OpenImageIO can't be loaded.
std::optional<std::vector<std::byte>> encode(const Pixels& pixels, Plane plane, ImageFormat format,
                                             const std::vector<std::uint8_t>* done = nullptr);

}  // namespace tessera
