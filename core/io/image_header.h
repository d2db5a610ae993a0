#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

namespace tessera {

/// What an image file is, as far as can be said without decoding it.
struct ImageHeader {
  const char* name;                     ///< A file's name that tells OpenImageIO its format.
  std::uint32_t width = 0, height = 0;  ///< 0 where only a library can tell.
  std::uint32_t bytes_a_texel = 0;      ///< At most, decoded at the file's own depth.
  bool has_alpha = false;               ///< For certain: of PNG, WebP and Targa.
};

/// PNG (ISO/IEC 15948), JPEG (ITU T.81), WebP (RFC 9649), and by their first bytes Radiance, OpenEXR, BMP and TIFF, and
/// what may be Targa. A sentence where it is none of them or its header is broken.
std::variant<ImageHeader, std::string> read_image_header(std::span<const std::byte> file);

}  // namespace tessera
