#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/io/module_missing.h"
#include "core/scene/texture.h"

namespace tessera {

/// The bytes of an image file.
using ImageFile = std::shared_ptr<const std::vector<std::byte>>;

/// An image whose texels take at most `most_bytes`, or a sentence that says what is wrong with it. Of PNG, JPEG and
/// WebP only the header is looked at; what is wrong behind it shows once the image is decoded. Throws std::bad_alloc,
/// and `ModuleMissing` where OpenImageIO isn't there.
std::variant<std::shared_ptr<const TextureImage>, std::string> open_texture(ImageFile file, std::uint64_t most_bytes);

}  // namespace tessera
