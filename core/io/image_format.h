#pragma once

#include <cstdint>

namespace tessera {

enum class ImageFormat { png, jpeg, exr, hdr, tiff };

/// What the pixels of a file can be.
enum class PixelValues {
  display,  ///< 8 bits a channel, of one plane, made to be looked at.
  rgbe,     ///< Three finite floats that aren't negative, with one exponent (Ward 1991): 1% of the largest of them.
  single,   ///< One channel of floats, as they are.
  exact,    ///< Any number of channels of floats and ids, as they are.
};

/// What files of a format can hold, as far as the libraries that write and read them go.
struct FormatLimits {
  ImageFormat format;
  std::uint32_t max_width, max_height;
  std::uint64_t max_row_bytes, max_bytes;  ///< Of values, before compression.
  PixelValues values;
  bool alpha;
};
const FormatLimits& limits_of(ImageFormat format);

}  // namespace tessera
