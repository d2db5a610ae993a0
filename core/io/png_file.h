#pragma once

#include <cstddef>
#include <optional>
#include <stop_token>
#include <vector>

#include "core/io/raster.h"

namespace tessera {

/// A PNG, through libpng: of sRGB display values, where the raster has 3 channels of bytes, or 4 of which the last is
/// alpha; or grey, of one channel of words, which are numbers of whatever is measured.
/// Nothing once `stop` is requested, which is looked at before every row. Throws std::bad_alloc, and std::runtime_error
/// with libpng's words for anything else. Precondition: the size is within `limits_of`.
std::optional<std::vector<std::byte>> write_png(const Raster& raster, const std::stop_token& stop = {});

}  // namespace tessera
