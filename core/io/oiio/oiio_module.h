#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "core/io/image_format.h"
#include "core/io/image_header.h"
#include "core/io/raster.h"
#include "core/io/read_texture.h"
#include "core/scene/light.h"
#include "core/scene/texture.h"

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

/// Fills in the sizes of a file whose format `name` tells, or assigns to `problem` what is wrong with it. Throws
/// std::bad_alloc.
void tessera_oiio_measure(const char* name, std::span<const std::byte> file, tessera::ImageHeader& header,
                          std::string& problem);

/// Reads a file whose format `name` tells into `texels`, at the depth that it has, or assigns to `problem` what is
/// wrong with it, as when it takes more than `most_bytes`. They lie in `room`; `floats` are those of them that are
/// floats. Throws std::bad_alloc, and what `room` throws.
void tessera_oiio_read_texture(const char* name, std::span<const std::byte> file, std::uint64_t most_bytes,
                               const tessera::TexelRoom& room, tessera::Texels& texels, std::span<float>& floats,
                               std::string& problem);
}
