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

namespace tessera {

/// An image as its file holds it: rows from the top, channels interleaved, alpha not multiplied into the others. Floats
/// are in 0..`kLargestLight`. One channel is grey, two are grey and alpha, three RGB, four RGBA.
struct Texels {
  std::uint32_t width = 0, height = 0, channels = 0;  ///< ≥ 1 each; channels ≤ 4.
  std::variant<std::vector<std::uint8_t>, std::vector<std::uint16_t>, std::vector<float>> values;
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

  /// A single white texel where the file is broken. Who asks first decodes, who asks meanwhile waits; where that
  /// throws, the next one tries again.
  const Texels& texels() const;

  /// What was wrong with the file; empty while it hasn't been decoded.
  std::string problem() const;

  std::size_t bytes() const { return bytes_; }

 private:
  std::size_t bytes_;
  mutable Decode decode_;  ///< Gone once it has returned, with the file that it holds.
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
