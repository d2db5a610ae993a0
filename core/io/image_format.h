#pragma once

namespace tessera {

enum class ImageFormat { png, jpeg, exr, hdr };

}  // namespace tessera
