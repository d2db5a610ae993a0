#pragma once

#include <filesystem>

#include "tests/support/float_image.h"

namespace tessera::bench {

/// The first three channels of an image file, as linear floats. Throws std::runtime_error.
FloatImage read_exr(const std::filesystem::path& path);

}  // namespace tessera::bench
