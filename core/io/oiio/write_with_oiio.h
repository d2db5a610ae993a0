#pragma once

#include <cstddef>
#include <optional>
#include <stop_token>
#include <vector>

#include "core/io/image_format.h"
#include "core/io/raster.h"

namespace tessera {

/// An EXR or HDR, through OpenImageIO. The first call loads it, by way of the module tessera_oiio: it comes with some
/// 260 shared libraries, which take a quarter of a second to load, longer than many a job takes. Nothing once `stop` is
/// requested, which is looked at every few rows. Throws std::bad_alloc, and std::runtime_error with OpenImageIO's
/// words, or with the loader's when it can't be loaded; later calls try again. Safe from any thread. Precondition: the
/// size is within `limits_of`.
std::optional<std::vector<std::byte>> write_with_oiio(ImageFormat format, const Raster& raster,
                                                      const std::stop_token& stop = {});

}  // namespace tessera
