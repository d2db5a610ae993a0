#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tessera {

/// What a channel's values are: 0 to 255 for display, or 32 bits, in the machine's byte order.
enum class ChannelType { byte, real, id };

struct Channel {
  std::string name;
  ChannelType type;
};

/// An image as a file is to hold it, row by row from the top; each pixel's channels side by side, without padding.
struct Raster {
  std::int32_t width, height;
  std::vector<Channel> channels;
  std::span<const std::byte> values;  ///< Somebody else's, for as long as the raster is used.
};

}  // namespace tessera
