#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <stop_token>
#include <vector>

#include "core/film/film.h"
#include "core/io/image_format.h"
#include "core/io/jpeg_file.h"

namespace tessera {

/// Which plane of the film to encode. `all` writes colour and every recorded AOV as channels of one EXR.
enum class Plane { color, depth, normal, primitive_id, object_id, cost_volumes, cost_primitives, all };

struct Encoding {
  ImageFormat format = ImageFormat::png;
  JpegOptions jpeg;  ///< Of no meaning to the others.
};

/// Whether files of a format can hold that plane of an image, and, with `partial`, that some of it isn't there yet: by
/// its size, and by its values, of which normals can be negative, depths infinite, and ids have to be exact.
bool can_hold(ImageFormat format, Plane plane, std::uint32_t width, std::uint32_t height,
              const std::set<Aov>& recorded);

/// Encodes to memory: PNG through libpng, JPEG through libjpeg, EXR and HDR through OpenImageIO, which the first of
/// them loads. Takes as much memory as the file, twice while it grows, and a few rows.
///
/// PNG and JPEG hold 8 bits of display values: colour is clamped to 0..1 and given sRGB's transfer curve; depth is
/// scaled from nearest (white) to farthest (dark grey) finite value, and black where it is infinite; normals map −1..1
/// to 0..255; ids become hues, of which JPEG keeps about the look; costs a heat map (`heat_color`) from 0 to the
/// greatest cost of the image. EXR holds the linear floats themselves, channels "R" "G" "B", "Z", "N.X" "N.Y" "N.Z",
/// "cost.volumes", "cost.primitives", and the ids as unsigned "primitiveId" and "objectId"; depths of the background
/// are infinite. HDR holds colour and costs (as grey) as RGBE: what is above its greatest number, just below 2^127,
/// becomes that.
///
/// `done`, one byte a pixel where given, tells the pixels that may be read. The others look as if nothing were there,
/// and are transparent in PNG and EXR, which get an alpha channel.
///
/// Nothing once `stop` is requested, or unless the film holds the plane and `can_hold`. Throws std::bad_alloc, and
/// std::runtime_error when a library fails.
std::optional<std::vector<std::byte>> encode(const Pixels& pixels, Plane plane, const Encoding& encoding,
                                             const std::vector<std::uint8_t>* done = nullptr,
                                             const std::stop_token& stop = {});

}  // namespace tessera
