#include "core/io/oiio/oiio_module.h"

#include <algorithm>
#include <array>
#include <exception>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

namespace tessera {
namespace {

/// A file's name tells OpenImageIO its format.
const char* name_of(ImageFormat format) {
  constexpr std::array kNames = {"image.png", "image.jpg", "image.exr", "image.hdr"};
  return kNames.at(static_cast<std::size_t>(format));
}

OIIO::TypeDesc type_of(ChannelType type) {
  constexpr std::array kTypes = {OIIO::TypeDesc::UINT8, OIIO::TypeDesc::FLOAT, OIIO::TypeDesc::UINT};
  return kTypes.at(static_cast<std::size_t>(type));
}

OIIO::ImageSpec spec_of(ImageFormat format, const Raster& raster) {
  const OIIO::TypeDesc first = type_of(raster.channels.at(0).type);
  OIIO::ImageSpec spec(raster.width, raster.height, static_cast<int>(raster.channels.size()), first);
  spec.channelnames.clear();
  for (const Channel& channel : raster.channels) {
    if (channel.name == "A") spec.alpha_channel = static_cast<int>(spec.channelnames.size());
    if (channel.name == "Z") spec.z_channel = static_cast<int>(spec.channelnames.size());
    spec.channelnames.push_back(channel.name);
    spec.channelformats.push_back(type_of(channel.type));
  }
  if (std::ranges::count(spec.channelformats, first) == std::ssize(spec.channelformats)) spec.channelformats.clear();
  switch (format) {
    case ImageFormat::jpeg:
      spec.attribute("oiio:ColorSpace", "sRGB");
      spec.attribute("CompressionQuality", 95);
      break;
    case ImageFormat::exr:
      spec.attribute("oiio:ColorSpace", "Linear");
      spec.attribute("compression", "zip");
      spec.attribute("DateTime", "1970:01:01 00:00:00");  // else it's the time now: equal pixels, equal bytes
      break;
    case ImageFormat::png:
    case ImageFormat::hdr:
      break;
  }
  return spec;
}

bool write(ImageFormat format, const Raster& raster, std::vector<std::byte>& file) {
  std::vector<unsigned char> buffer;
  OIIO::Filesystem::IOVecOutput memory(buffer);
  const char* name = name_of(format);
  const auto out = OIIO::ImageOutput::create(name, &memory);
  // The values are of the channels' own types.
  if (!out || !out->open(name, spec_of(format, raster)) ||
      !out->write_image(OIIO::TypeDesc::UNKNOWN, raster.values.data()) || !out->close())
    return false;
  const auto* first = reinterpret_cast<const std::byte*>(buffer.data());
  file.assign(first, first + buffer.size());
  return true;
}

}  // namespace
}  // namespace tessera

__attribute__((visibility("default"))) bool tessera_oiio_write(tessera::ImageFormat format,
                                                               const tessera::Raster& raster,
                                                               std::vector<std::byte>& file) noexcept {
  try {
    return tessera::write(format, raster, file);
  } catch (const std::exception&) {
    return false;
  }
}
