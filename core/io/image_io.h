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
#include "core/io/tone_map.h"
#include "core/math/rounding.h"

namespace tessera {

/// Which plane of the film to encode: colour where no AOV is named.
struct Plane {
  std::optional<Aov> aov = std::nullopt;
  bool is_all = false;  ///< Colour and every recorded AOV, as channels of one EXR.

  bool operator==(const Plane&) const = default;
};
inline constexpr Plane kColorPlane{};
inline constexpr Plane kAllPlanes{std::nullopt, true};

/// Of an EXR's floats.
enum class Precision { single, half };

/// Depths as a sensor tells them: 0 for what is too near, infinite for what is too far, or isn't there.
struct DepthSensor {
  float least = 0, greatest = kInfinity;  ///< Metres.
  /// As whole millimetres of 16 bits, the greatest of which, 65535, stands for all that is too far. Otherwise metres.
  bool is_in_millimetres = false;
};

struct Encoding {
  ImageFormat format = ImageFormat::png;
  JpegOptions jpeg = {};                    ///< Of no meaning to the others.
  Look look = {};                           ///< Of the colour in PNG and JPEG.
  Precision precision = Precision::single;  ///< Of EXR.
  bool transparent = false;                 ///< Colour has the recorded alpha. Precondition: it is recorded.
  bool has_alpha = false;                   ///< PNG has alpha even where nothing is transparent.
  /// Of depth, in TIFF and, where it is in millimetres, in PNG, which is grey then and has 16 bits.
  std::optional<DepthSensor> sensor = std::nullopt;
  /// Linear display values, 0 to 1, that show through where colour in PNG and JPEG is transparent.
  std::optional<Rgb> background = std::nullopt;
};

/// Whether files of a format can hold that plane of an image, and, with `partial`, that some of it isn't there yet: by
/// its size, and by its values, of which normals can be negative, depths infinite, and ids have to be exact.
bool can_hold(ImageFormat format, Plane plane, std::uint32_t width, std::uint32_t height,
              const std::set<Aov>& recorded);

/// Encodes to memory: PNG through libpng, JPEG through libjpeg, TIFF by itself, EXR and HDR through OpenImageIO, which
/// the first of them loads. Takes as much memory as the file, twice while it grows, and a few rows.
///
/// PNG and JPEG hold 8 bits of display values: colour as `Display` makes it is clamped to 0..1 and given sRGB's
/// transfer curve; AOVs look as their rows say (`AovLook`), of hues JPEG keeps about the look. EXR holds the linear
/// floats themselves, or the nearest ones of half as many bits (`half_bits`), channels "R" "G" "B" and those of the
/// AOVs' rows, whole numbers as unsigned ones. HDR holds what is finite and never negative as RGBE, single channels as
/// grey: what is above its greatest number, just below 2^127, becomes that. TIFF holds planes of single floats.
///
/// Where colour is transparent, that of a pixel is what covers it over black. It is so in EXR, beside channel "A", and
/// in JPEG and HDR, which have no alpha; a PNG holds the colour of what covers it and how much that is.
///
/// With a `background` nothing is transparent: what covers a pixel, as it is shown, is laid over it in linear light, so
/// that it is exactly the colour that was asked for where nothing is.
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
