#pragma once

#include <cstddef>
#include <optional>
#include <stop_token>
#include <vector>

#include "core/io/image_format.h"
#include "core/io/raster.h"

extern "C" {

/// The one function of the module tessera_oiio, which alone is linked with OpenImageIO (`write_with_oiio` loads it):
/// assigns to `file` what `write_with_oiio` returns, and throws what it throws. Safe from any thread.
void tessera_oiio_write(tessera::ImageFormat format, const tessera::Raster& raster, const std::stop_token& stop,
                        std::optional<std::vector<std::byte>>& file);
}
