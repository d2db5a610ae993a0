#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace tessera {

/// Why an OpenEXR file isn't given to a library that believes what its header says, and takes memory and time for it
/// before anything else is read; nothing when it may be: one flat part of at most `most_texels`, of a height that a
/// file of this size can hold, and with tiles and channels of sizes that occur. (OpenEXR File Layout, openexr.com.)
std::optional<std::string> exr_header_problem(std::span<const std::byte> file, std::uint64_t most_texels);

}  // namespace tessera
