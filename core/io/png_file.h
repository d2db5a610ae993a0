#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/io/raster.h"

namespace tessera {

/// A PNG of sRGB display values, through libpng. The raster has 3 channels of bytes, or 4 of which the last is alpha.
/// Nothing when libpng refuses: no pixel, or 4 GiB of them.
std::optional<std::vector<std::byte>> write_png(const Raster& raster);

}  // namespace tessera
