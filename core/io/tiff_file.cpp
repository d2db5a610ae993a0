#include "core/io/tiff_file.h"

#include <bit>
#include <cassert>
#include <cstring>

namespace tessera {
namespace {

// Types of a field.
constexpr std::uint16_t kShort = 3, kLong = 4, kRational = 5;

/// What is before the rows, in the machine's byte order, as they are.
class Header {
 public:
  explicit Header(std::vector<std::byte>& file) : file_(file) {}

  void text(const char* two) {
    add(std::bit_cast<std::uint8_t>(two[0]));
    add(std::bit_cast<std::uint8_t>(two[1]));
  }
  void number(std::uint16_t value) { add(value); }
  void number(std::uint32_t value) { add(value); }

  void short_field(std::uint16_t tag, std::uint16_t value) {
    field(tag, kShort);
    add(value);
    add(std::uint16_t{0});
  }
  void long_field(std::uint16_t tag, std::uint32_t value) {
    field(tag, kLong);
    add(value);
  }
  void rational_field(std::uint16_t tag, std::uint32_t where) {
    field(tag, kRational);
    add(where);
  }

 private:
  void field(std::uint16_t tag, std::uint16_t type) {
    add(tag);
    add(type);
    add(std::uint32_t{1});
  }

  template <typename T>
  void add(T value) {
    std::byte bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    file_.insert(file_.end(), bytes, bytes + sizeof value);
  }

  std::vector<std::byte>& file_;
};

}  // namespace

std::optional<std::vector<std::byte>> write_tiff(const Raster& raster, const std::stop_token& stop) {
  const ChannelType type = raster.channels.at(0).type;
  const bool is_real = type == ChannelType::real;
  const auto height = static_cast<std::uint32_t>(raster.height);
  const std::size_t row_bytes = raster.row_bytes();
  std::vector<std::byte> file;
  file.reserve(kTiffHeader + row_bytes * height);
  Header header(file);
  header.text(std::endian::native == std::endian::little ? "II" : "MM");
  header.number(std::uint16_t{42});
  header.number(std::uint32_t{8});
  header.number(std::uint16_t{14});
  header.long_field(256, static_cast<std::uint32_t>(raster.width));         // ImageWidth
  header.long_field(257, height);                                           // ImageLength
  header.short_field(258, static_cast<std::uint16_t>(8 * bytes_of(type)));  // BitsPerSample
  header.short_field(259, 1);                                               // Compression: none
  header.short_field(262, 1);                                               // Photometric: 0 is black
  header.long_field(273, static_cast<std::uint32_t>(kTiffHeader));          // StripOffsets
  header.short_field(274, 1);                                               // Orientation: from the top left
  header.short_field(277, 1);                                               // SamplesPerPixel
  header.long_field(278, height);                                           // RowsPerStrip
  header.long_field(279, static_cast<std::uint32_t>(row_bytes * height));   // StripByteCounts
  header.rational_field(282, static_cast<std::uint32_t>(kTiffHeader - 8));  // XResolution
  header.rational_field(283, static_cast<std::uint32_t>(kTiffHeader - 8));  // YResolution
  header.short_field(296, 1);                                               // ResolutionUnit: none
  header.short_field(339, static_cast<std::uint16_t>(is_real ? 3 : 1));     // SampleFormat
  header.number(std::uint32_t{0});                                          // There is no further image.
  header.number(std::uint32_t{1});                                          // The resolutions: 1 / 1.
  header.number(std::uint32_t{1});
  assert(file.size() == kTiffHeader);
  file.resize(kTiffHeader + row_bytes * height);
  for (std::int32_t y = 0; y < raster.height; ++y) {
    if (stop.stop_requested()) return std::nullopt;
    raster.read_row(y, file.data() + kTiffHeader + row_bytes * static_cast<std::size_t>(y));
  }
  return file;
}

}  // namespace tessera
