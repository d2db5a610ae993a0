#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/scene/texture.h"

namespace tessera {

/// An image that has been decoded all along; counts how often that was asked for.
inline std::shared_ptr<const TextureImage> image_of(Texels texels, std::shared_ptr<std::atomic<int>> decoded = {}) {
  return std::make_shared<const TextureImage>(std::size_t{1}, [texels = std::move(texels), decoded] {
    if (decoded) ++*decoded;
    return TextureImage::Decoded{texels, {}};
  });
}

/// Of one channel, row by row.
inline std::shared_ptr<const TextureImage> grey_image(std::uint32_t width, std::uint32_t height,
                                                      std::vector<std::uint8_t> values) {
  return image_of({width, height, 1, std::move(values)});
}

}  // namespace tessera
