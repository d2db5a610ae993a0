#include "core/math/portable.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace tessera {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

// π/2 in three parts. The first two have 49 bits, so that a multiple up to 8 of them is exact; with a third even
// an argument that is the double next to a multiple of π keeps all its digits.
constexpr double kHalfPiHigh = 0x1.921fb54442d10p+0, kHalfPiMiddle = 0x1.08d313198a2e0p-49,
                 kHalfPiLow = 0x1.b839a252049c1p-104;
constexpr double kLargestAngle = 4 * std::numbers::pi;

/// What π/2 and π/4 lack as doubles.
constexpr double kHalfPiRest = 0x1.1a62633145c07p-54, kQuarterPiRest = kHalfPiRest / 2;

/// 1/k!; every k! up to 22! is a double.
constexpr auto kInverseFactorial = [] {
  std::array<double, 19> inverse{};
  double factorial = 1;
  for (std::size_t k = 0; k < inverse.size(); ++k) {
    factorial *= k == 0 ? 1 : static_cast<double>(k);
    inverse[k] = 1 / factorial;
  }
  return inverse;
}();

/// An unevaluated sum; `low` is what `high` lost to rounding.
struct Sum {
  double high, low;
};

/// a + b without loss when |a| ≥ |b| (Dekker 1971).
Sum fast_two_sum(double a, double b) {
  const double high = a + b;
  return {high, b - (high - a)};
}

/// a + b without loss (Knuth).
Sum two_sum(double a, double b) {
  const double high = a + b;
  const double b_seen = high - a;
  return {high, (a - (high - b_seen)) + (b - b_seen)};
}

/// a · b without loss (Dekker 1971, Veltkamp's split).
Sum two_product(double a, double b) {
  constexpr double kSplit = 0x1p27 + 1;
  const double a_high = kSplit * a - (kSplit * a - a), a_low = a - a_high;
  const double b_high = kSplit * b - (kSplit * b - b), b_low = b - b_high;
  const double high = a * b;
  return {high, a_low * b_low - (((high - a_high * b_high) - a_low * b_high) - a_high * b_low)};
}

/// (a.high + a.low) / (b.high + b.low), rounded to a little more than half an ulp.
double quotient(Sum a, Sum b) {
  const double q = a.high / b.high;
  const Sum product = two_product(q, b.high);
  return q + (((a.high - product.high) - product.low) + (a.low - q * b.low)) / b.high;
}

struct SineCosine {
  Sum sine, cosine;
};

/// Taylor's series on [-π/4, π/4]; what is left out is below 2^-58 of the result.
SineCosine series(Sum r) {
  const double z = r.high * r.high;
  double odd = 0, even = 0;  // sin r = r + r z · odd,  cos r = 1 - z/2 + z² · even
  for (std::size_t k = 18; k >= 4; k -= 2) {
    even = kInverseFactorial[k] - z * even;
    odd = kInverseFactorial[k - 1] - z * odd;
  }
  const Sum square = two_product(r.high, r.high);
  const Sum cosine = fast_two_sum(1, -square.high / 2);
  return {fast_two_sum(r.high, r.low * (1 - z / 2) - r.high * z * odd),
          fast_two_sum(cosine.high, cosine.low - square.low / 2 + (z * z * even - r.high * r.low))};
}

SineCosine sine_cosine(double radians) {
  if (!(std::abs(radians) <= kLargestAngle)) return {{kNan, kNan}, {kNan, kNan}};
  const double n = std::floor(radians * (2 / std::numbers::pi) + 0.5);
  // The first difference is exact (Sterbenz), and the second keeps its rounding error.
  Sum r = two_sum(radians - n * kHalfPiHigh, -(n * kHalfPiMiddle));
  r = fast_two_sum(r.high, r.low - n * kHalfPiLow);
  const auto [s, c] = series(r);
  switch (static_cast<int>(n) & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, {-s.high, -s.low}};
    case 2:
      return {{-s.high, -s.low}, {-c.high, -c.low}};
    default:
      return {{-c.high, -c.low}, s};
  }
}

/// x + x³ · (-1/3 + x²/5 - ...), for |x| ≤ tan(π/8): the part after x.
double atan_series(double x) {
  const double z = x * x;
  double sum = 0;
  for (int k = 43; k >= 3; k -= 2) sum = 1.0 / k - z * sum;
  return -x * z * sum;
}

/// atan x for x in [0, 1].
Sum atan_unit(double x) {
  constexpr double kTanEighthPi = std::numbers::sqrt2 - 1;
  if (x <= kTanEighthPi) return fast_two_sum(x, atan_series(x));
  const double t = quotient({x - 1, 0}, fast_two_sum(1, x));  // atan x = π/4 + atan t
  const Sum sum = fast_two_sum(std::numbers::pi / 4, t);
  return fast_two_sum(sum.high, sum.low + (atan_series(t) + kQuarterPiRest));
}

}  // namespace

double portable_sin(double radians) { return sine_cosine(radians).sine.high; }

double portable_cos(double radians) { return sine_cosine(radians).cosine.high; }

double portable_tan(double radians) {
  const auto [s, c] = sine_cosine(radians);
  return quotient(s, c);
}

double portable_atan(double x) {
  const double size = std::abs(x);
  if (size <= 1) return std::copysign(atan_unit(size).high, x);
  const Sum rest = atan_unit(1 / size);  // atan x = π/2 - atan(1/x)
  const Sum sum = fast_two_sum(std::numbers::pi / 2, -rest.high);
  return std::copysign(sum.high + (sum.low + (kHalfPiRest - rest.low)), x);
}

double portable_log2(double x) {
  if (x == 0) return -kInfinite;
  if (!(x > 0)) return kNan;
  if (x == kInfinite) return x;
  int exponent = 0;
  double m = std::frexp(x, &exponent);
  if (m < std::numbers::sqrt2 / 2) {
    m *= 2;
    --exponent;
  }
  // With m in [√½, √2): ln m = 2 atanh s, s = (m - 1) / (m + 1), and m - 1 is exact. So 1 loses no digits.
  const double s = (m - 1) / (m + 1), z = s * s;
  double sum = 0;
  for (int k = 23; k >= 3; k -= 2) sum = 1.0 / k + z * sum;
  return exponent + (s + s * z * sum) * (2 / std::numbers::ln2);
}

double portable_exp2(double x) {
  if (!(x == x)) return x;
  if (x > 1024) return kInfinite;
  if (x < -1080) return 0;
  const double n = std::floor(x + 0.5);
  const double z = (x - n) * std::numbers::ln2;  // x - n is exact, in [-½, ½]
  double sum = 0;
  for (std::size_t k = 15; k >= 1; --k) sum = kInverseFactorial[k] + z * sum;
  return std::ldexp(1 + z * sum, static_cast<int>(n));
}

float portable_pow(float base, float exponent) {
  if (exponent == 0 || base == 1) return 1;
  return static_cast<float>(portable_exp2(exponent * portable_log2(base)));
}

}  // namespace tessera
