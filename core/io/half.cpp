#include "core/io/half.h"

#include <bit>
#include <cmath>

namespace tessera {
namespace {

constexpr std::uint32_t kFractionBits = 23 - 10;  // that a half doesn't have
constexpr std::uint32_t kSmallestNormal = std::bit_cast<std::uint32_t>(0x1p-14F);
constexpr std::uint32_t kGreatest = std::bit_cast<std::uint32_t>(65504.0F);
constexpr std::uint32_t kInfinite = std::bit_cast<std::uint32_t>(HUGE_VALF);
constexpr std::uint32_t kBiasDifference = (127U - 15U) << 23;

}  // namespace

std::uint16_t half_bits(float v) {
  const auto bits = std::bit_cast<std::uint32_t>(v);
  const auto sign = static_cast<std::uint16_t>(bits >> 16 & 0x8000);
  const std::uint32_t size = bits & 0x7FFFFFFF;
  std::uint32_t half = 0;
  if (size > kInfinite) {
    half = 0x7E00;
  } else if (size == kInfinite) {
    half = 0x7C00;
  } else if (size >= kGreatest) {
    half = 0x7BFF;
  } else if (size >= kSmallestNormal) {
    const std::uint32_t is_odd = size >> kFractionBits & 1;
    half = (size - kBiasDifference + (1U << (kFractionBits - 1)) - 1 + is_odd) >> kFractionBits;
  } else {
    // Beside 0.5 the last bit of a float counts 2^-24, as that of the smallest halves does.
    half = std::bit_cast<std::uint32_t>(std::bit_cast<float>(size) + 0.5F) - std::bit_cast<std::uint32_t>(0.5F);
  }
  return static_cast<std::uint16_t>(sign | half);
}

}  // namespace tessera
