#include "core/scene/texture.h"

#include <utility>

namespace tessera {

const Texels& TextureImage::texels() const {
  std::call_once(once_, [&] {
    Decoded decoded = decode_();
    texels_ = std::move(decoded.texels);
    if (texels_.width == 0) texels_ = {1, 1, 1, SharedValues<std::uint8_t>({255})};
    decode_ = nullptr;
    file_.bytes = nullptr;
    const std::lock_guard lock(mutex_);
    problem_ = std::move(decoded.problem);
  });
  return texels_;
}

std::string TextureImage::problem() const {
  const std::lock_guard lock(mutex_);
  return problem_;
}

}  // namespace tessera
