#include "core/io/display_curve.h"

#include <array>
#include <bit>

#include "core/math/portable.h"
#include "core/math/srgb.h"

namespace tessera {
namespace {

/// Precondition: `linear` in [0, 1].
std::uint8_t computed_byte(float linear) {
  const double v = linear;
  const double encoded = v <= 0.0031308 ? 12.92 * v : 1.055 * portable_exp2(portable_log2(v) / 2.4) - 0.055;
  return static_cast<std::uint8_t>(encoded * 255 + 0.5);
}

/// The curve is a staircase of 256 steps. Floats that share exponent and the first 8 bits of the fraction, a bin, span
/// at most 0.44 of a step's height (255 · v · the curve's slope · 2^-8, greatest at 1), so at most one step begins
/// among them: the byte of a bin's first float and where the next step begins tell all its bytes.
class Staircase {
 public:
  Staircase() {
    for (std::uint32_t bin = 0; bin < kBins; ++bin) {
      const std::uint32_t first = kFirst + (bin << kShift), last = first + (1U << kShift) - 1;
      bins_[bin] = {next_step(first, last), byte_at(first)};
    }
  }

  /// Precondition: `linear` in [kDark, 1).
  std::uint8_t operator()(float linear) const {
    const auto bits = std::bit_cast<std::uint32_t>(linear);
    const Bin& bin = bins_[(bits - kFirst) >> kShift];
    return static_cast<std::uint8_t>(bin.byte + (bits >= bin.next_step ? 1 : 0));
  }

  static constexpr float kDark = 0x1p-13F;  ///< Below it all bytes are 0: 255 · 12.92 · 2^-13 is 0.402.

 private:
  static constexpr int kShift = 15;
  static constexpr std::uint32_t kFirst = std::bit_cast<std::uint32_t>(kDark);
  static constexpr std::uint32_t kBins = (std::bit_cast<std::uint32_t>(1.0F) - kFirst) >> kShift;

  struct Bin {
    std::uint32_t next_step;  ///< The first float of the bin, by its bits, with the next byte; beyond it if none.
    std::uint8_t byte;
  };

  static std::uint8_t byte_at(std::uint32_t bits) { return computed_byte(std::bit_cast<float>(bits)); }

  static std::uint32_t next_step(std::uint32_t first, std::uint32_t last) {
    const std::uint8_t byte = byte_at(first);
    if (byte_at(last) == byte) return last + 1;
    while (last - first > 1) {
      const std::uint32_t middle = first + (last - first) / 2;
      (byte_at(middle) == byte ? first : last) = middle;
    }
    return last;
  }

  std::array<Bin, kBins> bins_;
};

}  // namespace

std::uint8_t display_byte(float linear) {
  static const Staircase kStaircase;
  if (!(linear >= Staircase::kDark)) return 0;
  return linear < 1 ? kStaircase(linear) : 255;
}

float display_light(std::uint8_t byte) { return light_of_encoded(byte / 255.0); }

}  // namespace tessera
