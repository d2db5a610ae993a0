#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/scene/light.h"
#include "core/scene/texture.h"
#include "proto/import/flat_archive.h"
#include "proto/import/import.h"
#include "proto/wire/result.h"

namespace tessera::proto {

/// Files of images that are at least so large are handed over beside the rest.
inline constexpr std::size_t kLargeImage = 4 << 20;

/// Writes what an import came to. `large_images` gets the files of large images; they and `imported` have to stay
/// where they are as long as `out` is used. Precondition: no image has been decoded, no light has a map.
void flatten_import(const Result<Imported>& imported, FlatWriter& out,
                    std::vector<std::span<const std::byte>>& large_images);

/// An image whose file is somewhere.
struct FlatImage {
  std::uint64_t bytes = 0;  ///< What its texels take.
  std::string name;         ///< As `EncodedImage` has it.
  std::uint64_t file_bytes = 0;
  std::span<const std::byte> file;  ///< Empty for a large image.
};

/// Makes images of what is handed over, in its order.
using MakeImage = std::function<std::shared_ptr<const TextureImage>(const FlatImage&)>;

/// Reads what `flatten_import` wrote, in a process that may have been in anybody's hands since it read the file:
/// whatever comes of it is as valid as what `import_file` returns. Throws `NotFlat`.
Result<Imported> unflatten_import(std::span<const std::byte> bytes, const MakeImage& make_image);

/// The same of an environment's map.
void flatten_environment(const Result<std::shared_ptr<const EnvironmentMap>>& map, FlatWriter& out);
Result<std::shared_ptr<const EnvironmentMap>> unflatten_environment(std::span<const std::byte> bytes);

}  // namespace tessera::proto
