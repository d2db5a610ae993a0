#include "core/io/read_texture.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/io/exr_header.h"
#include "core/io/image_header.h"
#include "core/io/oiio/load_module.h"
#include "core/io/oiio/oiio_module.h"
#include "core/scene/light.h"

namespace tessera {
namespace {

std::string too_large(const ImageHeader& header) {
  return "Its " + std::to_string(header.width) + " × " + std::to_string(header.height) +
         " texels take more memory than there may be.";
}

/// Numbers that no colour can be count as 0.
std::size_t mend(std::span<float> values) {
  std::size_t mended = 0;
  for (float& value : values) {
    if (value >= 0 && value <= kLargestLight) continue;
    value = 0;
    ++mended;
  }
  return mended;
}

/// A PNG, red.
constexpr std::uint8_t kOneTexel[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00, 0x00,
    0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x08, 0x02, 0x00, 0x00, 0x00, 0x90, 0x77, 0x53, 0xde, 0x00, 0x00, 0x00,
    0x0c, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63, 0xf8, 0xcf, 0xc0, 0x00, 0x00, 0x03, 0x01, 0x01, 0x00, 0xc9,
    0xfe, 0x92, 0xef, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82,
};

std::shared_ptr<std::byte[]> room_on_heap(std::size_t bytes) {
  return std::shared_ptr<std::byte[]>(new std::byte[bytes]);
}

}  // namespace

void load_image_library() { decode_texture("texture.png", std::as_bytes(std::span(kOneTexel)), 3, room_on_heap); }

TextureImage::Decoded decode_texture(const std::string& name, std::span<const std::byte> file, std::uint64_t most_bytes,
                                     const TexelRoom& room) {
  static const auto kRead = oiio_function<decltype(&tessera_oiio_read_texture)>("tessera_oiio_read_texture");
  TextureImage::Decoded decoded;
  std::span<float> floats;
  kRead(name.c_str(), file, most_bytes, room, decoded.texels, floats, decoded.problem);
  if (!decoded.problem.empty()) return decoded;
  if (const std::size_t mended = mend(floats); mended > 0)
    decoded.problem = std::to_string(mended) + " of its numbers are NaN, negative or beyond 1e18, and count as 0.";
  return decoded;
}

std::variant<std::shared_ptr<const TextureImage>, std::string> open_texture(ImageFile file, std::uint64_t most_bytes) {
  const auto read = read_image_header(*file);
  if (const auto* why = std::get_if<std::string>(&read)) return *why;
  auto header = std::get<ImageHeader>(read);
  const std::string_view name = header.name;
  if (name == "texture.exr")
    if (auto why = exr_header_problem(*file, most_bytes / sizeof(float))) return *std::move(why);
  if (header.width == 0) {
    static const auto kMeasure = oiio_function<decltype(&tessera_oiio_measure)>("tessera_oiio_measure");
    std::string problem;
    kMeasure(header.name, *file, header, problem);
    if (!problem.empty()) return problem;
  }
  const std::uint64_t texels = std::uint64_t{header.width} * header.height;
  if (texels > most_bytes / header.bytes_a_texel) return too_large(header);
  const auto bytes = static_cast<std::size_t>(texels * header.bytes_a_texel);
  return std::make_shared<const TextureImage>(
      bytes, EncodedImage{header.name, std::move(file)}, [bytes](const EncodedImage& encoded) {
        return decode_texture(encoded.name, *encoded.bytes, bytes, room_on_heap);
      });
}

}  // namespace tessera
