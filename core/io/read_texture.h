#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/io/module_missing.h"
#include "core/scene/texture.h"

namespace tessera {

/// Memory for so many bytes of texels, aligned for floats. Throws std::bad_alloc.
using TexelRoom = std::function<std::shared_ptr<std::byte[]>(std::size_t bytes)>;

/// Loads OpenImageIO now, and all that it loads when it is first used. Throws `ModuleMissing`.
void load_image_library();

/// The texels of an image file that `open_texture` has looked at, which gave `name` and that they take `most_bytes`;
/// none, and a sentence, where it is broken. Numbers that no texel can be count as 0, and are told of. Throws
/// std::bad_alloc, and what `room` throws.
TextureImage::Decoded decode_texture(const std::string& name, std::span<const std::byte> file, std::uint64_t most_bytes,
                                     const TexelRoom& room);

/// The bytes of an image file.
using ImageFile = std::shared_ptr<const std::vector<std::byte>>;

/// An image whose texels take at most `most_bytes`, or a sentence that says what is wrong with it. Of PNG, JPEG and
/// WebP only the header is looked at; what is wrong behind it shows once the image is decoded. Throws std::bad_alloc,
/// and `ModuleMissing` where OpenImageIO isn't there.
std::variant<std::shared_ptr<const TextureImage>, std::string> open_texture(ImageFile file, std::uint64_t most_bytes);

}  // namespace tessera
