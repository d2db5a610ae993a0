#include "tests/benchmarks/support/exr_file.h"

#include <OpenImageIO/imageio.h>

namespace tessera::bench {

FloatImage read_exr(const std::filesystem::path& path) {
  const auto file = OIIO::ImageInput::open(path.string());
  if (!file || file->spec().nchannels < 3) throw std::runtime_error("no colour image in " + path.string());
  const OIIO::ImageSpec& spec = file->spec();
  FloatImage image{static_cast<std::uint32_t>(spec.width), static_cast<std::uint32_t>(spec.height), {}};
  image.pixels.resize(std::size_t{image.width} * image.height);
  if (!file->read_image(0, 0, 0, 3, OIIO::TypeDesc::FLOAT, image.pixels.data()))
    throw std::runtime_error(path.string() + ": " + file->geterror());
  return image;
}

}  // namespace tessera::bench
