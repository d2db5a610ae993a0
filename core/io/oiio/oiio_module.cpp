#include "core/io/oiio/oiio_module.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

namespace tessera {
namespace {

/// A file's name tells OpenImageIO its format.
const char* name_of(ImageFormat format) { return format == ImageFormat::exr ? "image.exr" : "image.hdr"; }

OIIO::TypeDesc type_of(ChannelType type) {
  constexpr std::array kTypes = {OIIO::TypeDesc::UINT8, OIIO::TypeDesc::FLOAT, OIIO::TypeDesc::HALF,
                                 OIIO::TypeDesc::UINT};
  return kTypes.at(static_cast<std::size_t>(type));
}

/// OpenEXR packs 16 rows together, or each by itself, which is for rows so long that 16 would take a lot of memory.
constexpr std::size_t kLongRow = 4 << 20;
/// Rows that are handed over at once, which whole blocks of OpenEXR's make up.
constexpr std::size_t kBandBytes = 1 << 20;
constexpr int kBlockRows = 16;

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
  if (format == ImageFormat::exr) {
    spec.attribute("oiio:ColorSpace", "Linear");
    spec.attribute("compression", raster.row_bytes() > kLongRow ? "zips" : "zip");
    spec.attribute("DateTime", "1970:01:01 00:00:00");  // else it's the time now: equal pixels, equal bytes
  }
  return spec;
}

[[noreturn]] void fail(const std::string& why) { throw std::runtime_error("OpenImageIO: " + why); }

/// Whether all rows were written; not when `stop` was requested.
bool write_rows(OIIO::ImageOutput& out, const Raster& raster, const std::stop_token& stop) {
  const std::size_t row_bytes = raster.row_bytes();
  const auto blocks = static_cast<int>(kBandBytes / (row_bytes * kBlockRows));
  const int band = blocks > 0 ? blocks * kBlockRows : row_bytes > kLongRow ? 1 : kBlockRows;
  std::vector<std::byte> rows(row_bytes * static_cast<std::size_t>(std::min(band, raster.height)));
  for (int y = 0; y < raster.height; y += band) {
    if (stop.stop_requested()) return false;
    const int end = std::min(y + band, raster.height);
    for (int row = y; row < end; ++row)
      raster.read_row(row, rows.data() + row_bytes * static_cast<std::size_t>(row - y));
    // The values are of the channels' own types.
    if (!out.write_scanlines(y, end, 0, OIIO::TypeDesc::UNKNOWN, rows.data())) fail(out.geterror());
  }
  return true;
}

}  // namespace
}  // namespace tessera

__attribute__((visibility("default"))) void tessera_oiio_write(tessera::ImageFormat format,
                                                               const tessera::Raster& raster,
                                                               const std::stop_token& stop,
                                                               std::optional<std::vector<std::byte>>& file) {
  std::vector<unsigned char> buffer;
  OIIO::Filesystem::IOVecOutput memory(buffer);
  const char* name = tessera::name_of(format);
  const auto out = OIIO::ImageOutput::create(name, &memory);
  if (!out) tessera::fail(OIIO::geterror());
  if (!out->open(name, tessera::spec_of(format, raster))) tessera::fail(out->geterror());
  if (!tessera::write_rows(*out, raster, stop)) return;
  if (!out->close()) tessera::fail(out->geterror());
  const auto* first = reinterpret_cast<const std::byte*>(buffer.data());
  file.emplace(first, first + buffer.size());
}
