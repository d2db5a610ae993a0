#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/io/image_format.h"
#include "core/io/raster.h"

namespace tessera {

/// Encodes through OpenImageIO. The first call loads it, by way of the module tessera_oiio: it comes with some 260
/// shared libraries, which take a quarter of a second to load, longer than many a job takes. Nothing when the format
/// can't hold the raster. Throws std::runtime_error, with the loader's reason, when it can't be loaded; later calls try
/// again. Safe from any thread.
std::optional<std::vector<std::byte>> write_with_oiio(ImageFormat format, const Raster& raster);

}  // namespace tessera
