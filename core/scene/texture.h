#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <variant>
#include <vector>

#include "core/scene/shared_values.h"

namespace tessera {

/// An image as its file holds it: rows from the top, channels interleaved, alpha not multiplied into the others. Floats
/// are in 0..`kLargestLight`. One channel is grey, two are grey and alpha, three RGB, four RGBA.
struct Texels {
  std::uint32_t width = 0, height = 0, channels = 0;  ///< ≥ 1 each; channels ≤ 4.
  std::variant<SharedValues<std::uint8_t>, SharedValues<std::uint16_t>, SharedValues<float>> values;
};

/// An image as its file has it.
struct EncodedImage {
  std::string name;  ///< Of a file, by which OpenImageIO tells the format.
  std::shared_ptr<const std::vector<std::byte>> bytes = nullptr;
};

/// An image file whose texels are decoded when they are first asked for: never, where nothing asks. Safe to use from
/// any number of threads.
class TextureImage {
 public:
  /// The texels, none where the file is broken, and what is wrong with them.
  struct Decoded {
    Texels texels;
    std::string problem;
  };
  using Decode = std::function<Decoded()>;

  /// `bytes` is what the texels will take.
  TextureImage(std::size_t bytes, Decode decode) : bytes_(bytes), decode_(std::move(decode)) {}

  /// The same of a file, which `decode` is given.
  TextureImage(std::size_t bytes, EncodedImage file, std::function<Decoded(const EncodedImage&)> decode)
      : bytes_(bytes), file_(std::move(file)), decode_([this, decode = std::move(decode)] { return decode(file_); }) {}

  TextureImage(const TextureImage&) = delete;
  TextureImage& operator=(const TextureImage&) = delete;

  /// A single white texel where the file is broken. Who asks first decodes, who asks meanwhile waits; where that
  /// throws, the next one tries again.
  const Texels& texels() const;

  /// What was wrong with the file; empty while it hasn't been decoded.
  std::string problem() const;

  std::size_t bytes() const { return bytes_; }

  /// What it is decoded from, to decode it elsewhere; without bytes where it comes from no file. Precondition: nobody
  /// asks for the texels.
  const EncodedImage& file() const { return file_; }

 private:
  std::size_t bytes_;
  mutable EncodedImage file_;  ///< Without bytes once it has been decoded.
  mutable Decode decode_;      ///< Gone once it has returned.
  mutable std::once_flag once_;
  mutable Texels texels_;
  mutable std::mutex mutex_;  ///< Guards the problem.
  mutable std::string problem_;
};

/// What is beyond an image's edges.
enum class Wrap : std::uint8_t { repeat, clamp, mirror };

/// How an image lies on surfaces. (0, 0) is the upper left corner of the image, (1, 1) the lower right one.
struct Texture {
  std::shared_ptr<const TextureImage> image;
  Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
  bool is_nearest = false;                           ///< The texel that is met; otherwise four are mixed (bilinear).
  bool is_srgb = false;                              ///< All channels but alpha are encoded by sRGB's curve.
  std::uint8_t uv_set = 0;                           ///< Into `MeshAttributes::uvs`.
  std::array<float, 6> transform{1, 0, 0, 0, 1, 0};  ///< (a u + b v + c, d u + e v + f) is looked up.
  std::string name = {};                             ///< Where its image stands, for messages.
};

}  // namespace tessera
