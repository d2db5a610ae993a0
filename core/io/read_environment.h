#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>

#include "core/io/module_missing.h"
#include "core/scene/light.h"

namespace tessera {

/// The map in a Radiance (.hdr) or OpenEXR file, told apart by how they begin: its colours "R" "G" "B" or "Y", as they
/// are, of the first picture in it; of more than one level of detail the finest. Or a sentence that says why there is
/// none: broken, larger than `most_bytes` of texels, or with texels that are NaN, negative or above kLargestLight.
/// Through OpenImageIO, loaded as for `write_with_oiio`, and throws what that throws. Safe from any thread.
std::variant<EnvironmentMap, std::string> read_environment(std::span<const std::byte> file, std::uint64_t most_bytes);

}  // namespace tessera
