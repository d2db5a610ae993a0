#include "core/math/orientation.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace tessera {
namespace {

int sign(double v) { return (v > 0) - (v < 0); }

/// A sum of products of three floats, exactly: one long whole number in units of 2^-447, the product of the smallest
/// floats. Three largest floats reach 2^831 of these, and the terms of a determinant 2^836.
class ExactSum {
 public:
  void add(int sign_of_term, float a, float b, float c) {
    const Parts pa(a), pb(b), pc(c);
    const std::uint64_t ab = pa.mantissa * pb.mantissa;  // 48 bits
    const bool negative = (pa.negative != pb.negative) != (pc.negative != (sign_of_term < 0));
    const unsigned at = pa.exponent + pb.exponent + pc.exponent;
    add_shifted((ab & 0xFFFFFF) * pc.mantissa, at, negative);
    add_shifted((ab >> 24) * pc.mantissa, at + 24, negative);
  }

  int sign() {
    const bool negative = carry_over() < 0;
    if (negative) return -1;
    return std::ranges::any_of(digits_, [](std::int64_t digit) { return digit != 0; });
  }

  /// The sum, with its sign and good to 2^-50 of itself.
  double value() {
    const bool negative = carry_over() < 0;
    if (negative) {
      for (std::int64_t& digit : digits_) digit = -digit;
      carry_over();
    }
    double sum = 0;
    for (int i = static_cast<int>(digits_.size()) - 1; i >= 0; --i)
      sum += std::ldexp(static_cast<double>(digits_[static_cast<std::size_t>(i)]), 32 * i - 447);
    return negative ? -sum : sum;
  }

 private:
  /// A float as mantissa · 2^exponent in units of the smallest one.
  struct Parts {
    explicit Parts(float v) {
      const auto bits = std::bit_cast<std::uint32_t>(v);
      const unsigned biased = bits >> 23 & 0xFF;
      negative = bits >> 31;
      mantissa = (bits & 0x7FFFFF) | (biased ? 0x800000 : 0);
      exponent = biased ? biased - 1 : 0;
    }
    std::uint64_t mantissa;
    unsigned exponent;
    bool negative;
  };

  /// Brings all digits into [0, 2^32); returns what is left above them, negative if the sum is.
  std::int64_t carry_over() {
    std::int64_t carry = 0;
    for (std::int64_t& digit : digits_) {
      digit += carry;
      carry = digit >> 32;
      digit &= 0xFFFFFFFF;
    }
    return carry;
  }

  /// Adds ±v · 2^at, v of 48 bits. A digit takes 2^31 such terms before it overflows.
  void add_shifted(std::uint64_t v, unsigned at, bool negative) {
    const unsigned digit = at / 32, shift = at % 32;
    const std::uint64_t low = (v & 0xFFFFFFFF) << shift, high = (v >> 32) << shift;
    const std::uint64_t parts[3] = {low & 0xFFFFFFFF, (low >> 32) + (high & 0xFFFFFFFF), high >> 32};
    for (unsigned i = 0; i < 3; ++i) {
      const auto part = static_cast<std::int64_t>(parts[i]);
      digits_[digit + i] += negative ? -part : part;
    }
  }

  std::array<std::int64_t, 28> digits_{};  // 32 bits each, with room for carries
};

/// Adds ± det(p, q, r).
void add_determinant(ExactSum& sum, int sign_of_term, Vec3 p, Vec3 q, Vec3 r) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    sum.add(sign_of_term, p[i], q[j], r[k]);
    sum.add(-sign_of_term, p[i], q[k], r[j]);
  }
}

/// Adds ± (p × q)[axis].
void add_cross(ExactSum& sum, int sign_of_term, int axis, Vec3 p, Vec3 q) {
  const int j = (axis + 1) % 3, k = (axis + 2) % 3;
  sum.add(sign_of_term, p[j], q[k], 1);
  sum.add(-sign_of_term, p[k], q[j], 1);
}

/// det(a − o, b − o, c − o).
ExactSum sum_of_volume(Vec3 o, Vec3 a, Vec3 b, Vec3 c) {
  ExactSum sum;
  add_determinant(sum, 1, a, b, c);
  add_determinant(sum, -1, o, b, c);
  add_determinant(sum, 1, o, a, c);
  add_determinant(sum, -1, o, a, b);
  return sum;
}

}  // namespace

int orientation(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  const Vec3d ab = to_double(b) - to_double(a), ac = to_double(c) - to_double(a), ad = to_double(d) - to_double(a);
  const double xy = ab.x * ac.y, yx = ab.y * ac.x, yz = ab.y * ac.z, zy = ab.z * ac.y, zx = ab.z * ac.x,
               xz = ab.x * ac.z;
  const double volume = (yz - zy) * ad.x + (zx - xz) * ad.y + (xy - yx) * ad.z;
  const double permanent = (std::abs(yz) + std::abs(zy)) * std::abs(ad.x) +
                           (std::abs(zx) + std::abs(xz)) * std::abs(ad.y) +
                           (std::abs(xy) + std::abs(yx)) * std::abs(ad.z);
  // Shewchuk's bound is (7 + 56ε)·ε of the permanent, ε = 2^-53; products of three floats don't underflow a double.
  if (std::abs(volume) > permanent * 0x1p-50) return sign(volume);

  return -sum_of_volume(d, a, b, c).sign();
}

int orientation_along(int axis, Vec3 a, Vec3 b, Vec3 c) {
  const int j = (axis + 1) % 3, k = (axis + 2) % 3;
  const Vec3d ab = to_double(b) - to_double(a), ac = to_double(c) - to_double(a);
  const double jk = ab[j] * ac[k], kj = ab[k] * ac[j];
  // (3 + 16ε)·ε of the sum, likewise.
  if (std::abs(jk - kj) > (std::abs(jk) + std::abs(kj)) * 0x1p-51) return sign(jk - kj);

  ExactSum sum;
  add_cross(sum, 1, axis, b, c);
  add_cross(sum, -1, axis, a, c);
  add_cross(sum, 1, axis, a, b);
  return sum.sign();
}

double turning(Vec3 origin, Vec3 direction, Vec3 p, Vec3 q) {
  ExactSum sum;
  add_determinant(sum, 1, direction, p, q);
  add_determinant(sum, -1, direction, p, origin);
  add_determinant(sum, -1, direction, origin, q);
  return sum.value();
}

double volume(Vec3 origin, Vec3 a, Vec3 b, Vec3 c) { return sum_of_volume(origin, a, b, c).value(); }

}  // namespace tessera
