#include "core/io/oiio/oiio_module.h"

#include <algorithm>
#include <array>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

namespace tessera {
namespace {

/// A file's name tells OpenImageIO its format.
const char* name_of(ImageFormat format) { return format == ImageFormat::exr ? "image.exr" : "image.hdr"; }

OIIO::TypeDesc type_of(ChannelType type) {
  constexpr std::array kTypes = {OIIO::TypeDesc::UINT8, OIIO::TypeDesc::FLOAT, OIIO::TypeDesc::HALF,
                                 OIIO::TypeDesc::UINT, OIIO::TypeDesc::UINT16};
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

/// Where a picture's colours begin, and how many channels they take: 3, or 1 where all are alike.
struct Colors {
  int first, count;
};
std::optional<Colors> colors_of(const OIIO::ImageSpec& spec) {
  const int red = spec.channelindex("R"), grey = spec.channelindex("Y");
  if (red >= 0 && spec.channelindex("G") == red + 1 && spec.channelindex("B") == red + 2) return Colors{red, 3};
  if (grey >= 0) return Colors{grey, 1};
  return std::nullopt;
}

/// A library's message, which may have several lines, in one.
std::string in_a_line(const std::string& message) {
  std::string line;
  for (const char c : message) {
    const bool is_control = static_cast<unsigned char>(c) < 0x20;
    if (!is_control) line += c;
    if (is_control && !line.empty() && !line.ends_with("; ")) line += "; ";
  }
  if (line.ends_with("; ")) line.resize(line.size() - 2);
  return line;
}

/// What is wrong with the file; nothing once `map` is read.
std::string read(const char* name, std::span<const std::byte> file, std::uint64_t most_bytes, EnvironmentMap& map) {
  OIIO::Filesystem::IOMemReader memory(const_cast<std::byte*>(file.data()), file.size());
  const auto in = OIIO::ImageInput::open(name, nullptr, &memory);
  if (!in) return OIIO::geterror();
  const OIIO::ImageSpec spec = in->spec();
  if (spec.deep || spec.depth > 1) return "It isn't a flat picture.";
  if (spec.width < 1 || spec.height < 1) return "It has no texels.";
  if (spec.x != spec.full_x || spec.y != spec.full_y || spec.width != spec.full_width ||
      spec.height != spec.full_height)
    return "Its texels don't fill its display window.";
  const std::size_t texels = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height);
  if (texels > most_bytes / sizeof(Rgb))
    return "Its " + std::to_string(spec.width) + " × " + std::to_string(spec.height) +
           " texels take more memory than there may be.";
  const auto colors = colors_of(spec);
  if (!colors) return "It has no channels R, G and B, and no channel Y.";

  map.width = static_cast<std::uint32_t>(spec.width);
  map.height = static_cast<std::uint32_t>(spec.height);
  map.texels.resize(texels);
  if (!in->read_image(0, 0, colors->first, colors->first + colors->count, OIIO::TypeDesc::FLOAT, map.texels.data(),
                      sizeof(Rgb)))
    return in->geterror();
  if (colors->count == 1)
    for (Rgb& texel : map.texels) texel.g = texel.b = texel.r;
  return {};
}

/// As many as `Texels` may have.
constexpr int kMostChannels = 4;

/// Bytes of a texel's number: what has more than 8 bits is kept in 16, or as a float.
std::uint32_t depth_of(const OIIO::ImageSpec& spec) {
  if (spec.format.is_floating_point() || spec.format.size() > 2) return sizeof(float);
  return static_cast<std::uint32_t>(spec.format.size());
}

std::string measure(const char* name, std::span<const std::byte> file, ImageHeader& header) {
  OIIO::Filesystem::IOMemReader memory(const_cast<std::byte*>(file.data()), file.size());
  const auto in = OIIO::ImageInput::open(name, nullptr, &memory);
  if (!in) return OIIO::geterror();
  const OIIO::ImageSpec spec = in->spec();
  if (spec.deep || spec.depth > 1) return "It isn't a flat picture.";
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1) return "It has no texels.";
  if (spec.nchannels > kMostChannels) return "It has more than four channels.";
  header.width = static_cast<std::uint32_t>(spec.width);
  header.height = static_cast<std::uint32_t>(spec.height);
  header.bytes_a_texel = static_cast<std::uint32_t>(std::min(spec.nchannels, kMostChannels)) * depth_of(spec);
  return {};
}

/// Into `values`, which become those of the texels.
template <typename T>
std::string read_values(OIIO::ImageInput& in, OIIO::TypeDesc type, std::size_t count, const TexelRoom& room,
                        Texels& texels, std::span<T>& values) {
  const std::shared_ptr<std::byte[]> memory = room(count * sizeof(T));
  values = {reinterpret_cast<T*>(memory.get()), count};
  if (!in.read_image(0, 0, 0, static_cast<int>(texels.channels), type, values.data())) return in.geterror();
  texels.values = SharedValues<T>(values, memory);
  return {};
}

/// Of four channels.
void divide_by_alpha(std::span<std::uint8_t> values) {
  for (std::size_t i = 0; i + 3 < values.size(); i += 4) {
    const unsigned alpha = values[i + 3];
    if (alpha == 0) continue;
    for (std::size_t k = i; k < i + 3; ++k)
      values[k] = static_cast<std::uint8_t>(std::min((values[k] * 255 + alpha / 2) / alpha, 255U));
  }
}

std::string read_texture(const char* name, std::span<const std::byte> file, std::uint64_t most_bytes,
                         const TexelRoom& room, Texels& texels, std::span<float>& floats) {
  OIIO::Filesystem::IOMemReader memory(const_cast<std::byte*>(file.data()), file.size());
  OIIO::ImageSpec as_it_is;
  as_it_is.attribute("oiio:UnassociatedAlpha", 1);
  OIIO::Filesystem::IOProxy* proxy = &memory;
  as_it_is.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, static_cast<void*>(&proxy));
  const auto in = OIIO::ImageInput::open(name, &as_it_is, &memory);
  if (!in) return OIIO::geterror();
  const OIIO::ImageSpec spec = in->spec();
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1) return "It has no texels.";
  if (spec.nchannels > kMostChannels) return "It has more than four channels.";
  Texels read{static_cast<std::uint32_t>(spec.width),
              static_cast<std::uint32_t>(spec.height),
              static_cast<std::uint32_t>(std::min(spec.nchannels, kMostChannels)),
              {}};
  const std::uint64_t count = std::uint64_t{read.width} * read.height * read.channels;
  const std::uint32_t depth = depth_of(spec);
  if (count > most_bytes / depth) return "Its texels are more than its header says.";
  std::string problem;
  std::span<std::uint8_t> bytes;
  std::span<std::uint16_t> words;
  if (depth == 1)
    problem = read_values(*in, OIIO::TypeDesc::UINT8, count, room, read, bytes);
  else if (depth == 2)
    problem = read_values(*in, OIIO::TypeDesc::UINT16, count, room, read, words);
  else
    problem = read_values(*in, OIIO::TypeDesc::FLOAT, count, room, read, floats);
  if (!problem.empty()) return problem;
  // OpenImageIO 2.4 multiplies by alpha in any case when it reads WebP.
  if (read.channels == 4 && std::string_view(in->format_name()) == "webp" &&
      spec.get_int_attribute("oiio:UnassociatedAlpha") == 0)
    divide_by_alpha(bytes);
  texels = std::move(read);
  return {};
}

}  // namespace
}  // namespace tessera

__attribute__((visibility("default"))) void tessera_oiio_measure(const char* name, std::span<const std::byte> file,
                                                                 tessera::ImageHeader& header,
                                                                 std::string& problem) try {
  problem = tessera::in_a_line(tessera::measure(name, file, header));
} catch (const std::bad_alloc&) {
  throw;
} catch (const std::exception& error) {
  problem = tessera::in_a_line(error.what());
}

__attribute__((visibility("default"))) void tessera_oiio_read_texture(const char* name, std::span<const std::byte> file,
                                                                      std::uint64_t most_bytes,
                                                                      const tessera::TexelRoom& room,
                                                                      tessera::Texels& texels, std::span<float>& floats,
                                                                      std::string& problem) try {
  problem = tessera::in_a_line(tessera::read_texture(name, file, most_bytes, room, texels, floats));
} catch (const std::bad_alloc&) {
  throw;
} catch (const std::exception& error) {
  problem = tessera::in_a_line(error.what());
}

__attribute__((visibility("default"))) void tessera_oiio_read(const char* name, std::span<const std::byte> file,
                                                              std::uint64_t most_bytes, tessera::EnvironmentMap& map,
                                                              std::string& problem) try {
  problem = tessera::in_a_line(tessera::read(name, file, most_bytes, map));
} catch (const std::bad_alloc&) {
  throw;
} catch (const std::exception& error) {  // OpenEXR's
  problem = tessera::in_a_line(error.what());
}

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
