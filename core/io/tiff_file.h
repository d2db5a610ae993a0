#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <vector>

#include "core/io/raster.h"

namespace tessera {

/// Bytes of a file before its rows.
inline constexpr std::uint64_t kTiffHeader = 8 + 2 + 14 * 12 + 4 + 8;

/// A TIFF (revision 6.0, with SampleFormat of its section 19) of one channel, of the type `real` or `word`, as it is,
/// in one strip: of what isn't compressed a file is a header and the rows, and OpenImageIO, which writes them too,
/// takes a quarter of a second to load. Nothing once `stop` is requested. Throws std::bad_alloc. Precondition: the size
/// is within `limits_of`.
std::optional<std::vector<std::byte>> write_tiff(const Raster& raster, const std::stop_token& stop = {});

}  // namespace tessera
