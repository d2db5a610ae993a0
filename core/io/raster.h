#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace tessera {

/// What a channel's values are: 0 to 255 for display, or 32 bits, in the machine's byte order.
enum class ChannelType { byte, real, id };

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
    for (const Channel& channel : channels) pixel += channel.type == ChannelType::byte ? 1 : 4;
    return pixel * static_cast<std::size_t>(width);
  }
};

}  // namespace tessera
