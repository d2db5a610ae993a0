#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/io/png_file.h"

namespace tessera {

/// A PNG file of one row, whose texels have 3 or 4 channels.
inline std::string png_bytes(std::size_t channels, const std::vector<std::uint8_t>& values) {
  Raster raster{static_cast<std::int32_t>(values.size() / channels), 1, {}, [&values](std::int32_t, std::byte* row) {
                  for (std::size_t i = 0; i < values.size(); ++i) row[i] = static_cast<std::byte>(values[i]);
                }};
  for (const char* name : {"R", "G", "B", "A"})
    if (raster.channels.size() < channels) raster.channels.push_back({name, ChannelType::byte});
  const std::vector<std::byte> file = *write_png(raster);
  return {reinterpret_cast<const char*>(file.data()), file.size()};
}

}  // namespace tessera
