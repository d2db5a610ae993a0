#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace tessera {

/// What a channel's values are, in the machine's byte order: 0 to 255 for display, floats of 32 or of 16 bits, or whole
/// numbers of 32 or of 16 bits.
enum class ChannelType { byte, real, half, id, word };

inline std::size_t bytes_of(ChannelType type) {
  return type == ChannelType::byte ? 1 : type == ChannelType::half || type == ChannelType::word ? 2 : 4;
}

struct Channel {
  std::string name;
  ChannelType type;
};

/// An image as a file is to hold it, a row at a time, so that no second copy of it is ever whole.
struct Raster {
  std::int32_t width, height;
  std::vector<Channel> channels;
  /// Writes row `y`, counted from the top, to `row`, which has `row_bytes()`: each pixel's channels side by side,
  /// without padding. Asked for in order. Doesn't throw.
  std::function<void(std::int32_t y, std::byte* row)> read_row;

  std::size_t row_bytes() const {
    std::size_t pixel = 0;
    for (const Channel& channel : channels) pixel += bytes_of(channel.type);
    return pixel * static_cast<std::size_t>(width);
  }
};

}  // namespace tessera
