#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "core/io/image_format.h"
#include "core/io/raster.h"
#include "core/scene/light.h"

extern "C" {

// The functions of the module tessera_oiio, which alone is linked with OpenImageIO (`oiio_function` loads it). Safe
// from any thread.

/// Assigns to `file` what `write_with_oiio` returns, and throws what it throws.
void tessera_oiio_write(tessera::ImageFormat format, const tessera::Raster& raster, const std::stop_token& stop,
                        std::optional<std::vector<std::byte>>& file);

/// Reads a file whose format `name` tells into `map`, or assigns to `problem` what is wrong with it: as
/// `read_environment`, but for what the texels are. Throws std::bad_alloc.
void tessera_oiio_read(const char* name, std::span<const std::byte> file, std::uint64_t most_bytes,
                       tessera::EnvironmentMap& map, std::string& problem);
}
