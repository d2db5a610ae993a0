#pragma once

#include <cstddef>
#include <optional>
#include <stop_token>
#include <vector>

#include "core/io/raster.h"

namespace tessera {

/// How many pixels share their colour (but not their brightness): none, two side by side, or two by two.
enum class Subsampling { s444, s422, s420 };

struct JpegOptions {
  int quality = 95;  ///< 1 to 100, the scale of the Independent JPEG Group.
  Subsampling subsampling = Subsampling::s444;
};

/// A baseline JPEG of display values, through libjpeg: OpenImageIO leaves its handler of errors in place, which ends
/// the process, when memory runs out, say. The raster has 3 channels of bytes. Nothing once `stop` is requested, which
/// is looked at before every row. Throws std::bad_alloc, and std::runtime_error with libjpeg's words for anything else.
/// Precondition: the size is within `limits_of`.
std::optional<std::vector<std::byte>> write_jpeg(const Raster& raster, const JpegOptions& options,
                                                 const std::stop_token& stop = {});

}  // namespace tessera
