#include "core/io/image_header.h"

#include <algorithm>

namespace tessera {
namespace {

using Bytes = std::span<const std::byte>;

bool begins_with(Bytes file, std::string_view magic) {
  return file.size() >= magic.size() && std::equal(magic.begin(), magic.end(), file.begin(),
                                                   [](char a, std::byte b) { return static_cast<std::byte>(a) == b; });
}

std::uint32_t byte_at(Bytes file, std::size_t at) { return std::to_integer<std::uint32_t>(file[at]); }
std::uint32_t big16(Bytes file, std::size_t at) { return byte_at(file, at) << 8 | byte_at(file, at + 1); }
std::uint32_t big32(Bytes file, std::size_t at) { return big16(file, at) << 16 | big16(file, at + 2); }
std::uint32_t little16(Bytes file, std::size_t at) { return byte_at(file, at) | byte_at(file, at + 1) << 8; }
std::uint32_t little24(Bytes file, std::size_t at) { return little16(file, at) | byte_at(file, at + 2) << 16; }

std::variant<ImageHeader, std::string> checked(const ImageHeader& header) {
  if (header.width == 0 || header.height == 0) return "It has no texels.";
  return header;
}

constexpr std::string_view kPng("\x89PNG\r\n\x1a\n", 8);

std::variant<ImageHeader, std::string> read_png(Bytes file) {
  constexpr std::size_t kHeaderEnd = 33;
  if (file.size() < kHeaderEnd || !begins_with(file.subspan(12), "IHDR")) return "It ends before its header does.";
  const std::uint32_t depth = byte_at(file, 24), kind = byte_at(file, 25);
  std::uint32_t channels = 4;   // of a palette, too, which may hold alpha
  if (kind == 0) channels = 2;  // one of the greys may be transparent
  if (kind == 4) channels = 2;
  return checked(
      {"texture.png", big32(file, 16), big32(file, 20), channels * (depth == 16 ? 2 : 1), kind == 4 || kind == 6});
}

std::variant<ImageHeader, std::string> read_jpeg(Bytes file) {
  std::size_t at = 2;
  while (at + 4 <= file.size()) {
    if (byte_at(file, at) != 0xFF) return "It has no marker where one has to be.";
    const std::uint32_t marker = byte_at(file, at + 1);
    if (marker == 0xFF) {  // padding
      ++at;
      continue;
    }
    if (marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8)) {  // without a length
      at += 2;
      continue;
    }
    const bool is_frame = marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (is_frame && at + 10 <= file.size())
      return checked({"texture.jpg", big16(file, at + 7), big16(file, at + 5), 4});
    at += 2 + big16(file, at + 2);
  }
  return "It ends before its header does.";
}

std::variant<ImageHeader, std::string> read_webp(Bytes file) {
  const std::string broken = "Its header is broken.";
  if (file.size() < 30) return broken;
  const Bytes chunk = file.subspan(12);
  ImageHeader header{.name = "texture.webp", .bytes_a_texel = 4};
  if (begins_with(chunk, "VP8 ")) {
    header.width = little16(chunk, 14) & 0x3FFF;
    header.height = little16(chunk, 16) & 0x3FFF;
  } else if (begins_with(chunk, "VP8L")) {
    const std::uint32_t sizes = little24(chunk, 9) | byte_at(chunk, 12) << 24;
    header.width = (sizes & 0x3FFF) + 1;
    header.height = (sizes >> 14 & 0x3FFF) + 1;
    header.has_alpha = (sizes >> 28 & 1) != 0;
  } else if (begins_with(chunk, "VP8X")) {
    header.width = little24(chunk, 12) + 1;
    header.height = little24(chunk, 15) + 1;
    header.has_alpha = (byte_at(chunk, 8) & 0x10) != 0;
  } else {
    return broken;
  }
  return checked(header);
}

/// It has no signature; but its kinds of pixels are few (Truevision TGA, 2.0).
bool may_be_targa(Bytes file) {
  if (file.size() < 18) return false;
  const std::uint32_t map = byte_at(file, 1), kind = byte_at(file, 2) & ~8U, depth = byte_at(file, 16);
  return map <= 1 && kind >= 1 && kind <= 3 && (depth == 8 || depth == 15 || depth == 16 || depth == 24 || depth == 32);
}

}  // namespace

std::variant<ImageHeader, std::string> read_image_header(Bytes file) {
  if (begins_with(file, kPng)) return read_png(file);
  if (begins_with(file, "\xFF\xD8\xFF")) return read_jpeg(file);
  if (begins_with(file, "RIFF") && file.size() >= 12 && begins_with(file.subspan(8), "WEBP")) return read_webp(file);
  if (begins_with(file, "\x76\x2f\x31\x01")) return ImageHeader{"texture.exr"};
  if (begins_with(file, "#?RADIANCE") || begins_with(file, "#?RGBE")) return ImageHeader{"texture.hdr"};
  if (begins_with(file, "BM")) return ImageHeader{"texture.bmp"};
  if (begins_with(file, std::string_view("II*\0", 4)) || begins_with(file, std::string_view("MM\0*", 4)))
    return ImageHeader{"texture.tif"};
  if (may_be_targa(file)) return ImageHeader{.name = "texture.tga", .has_alpha = byte_at(file, 16) == 32};
  return "It is no image of a kind that is known here (PNG, JPEG, WebP, EXR, HDR, TIFF, BMP, Targa).";
}

}  // namespace tessera
