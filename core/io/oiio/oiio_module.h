#pragma once

#include <cstddef>
#include <vector>

#include "core/io/image_format.h"
#include "core/io/raster.h"

extern "C" {

/// The one function of the module tessera_oiio, which alone is linked with OpenImageIO (`write_with_oiio` loads it).
/// Whether OpenImageIO could encode the raster; then `file` is it. Safe from any thread.
bool tessera_oiio_write(tessera::ImageFormat format, const tessera::Raster& raster,
                        std::vector<std::byte>& file) noexcept;
}
