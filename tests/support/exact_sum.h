#pragma once

namespace tessera {

/// Whether p + q, without any rounding, is less than v (−1), v (0) or more (1). The rounded sum decides unless it
/// equals v, and then its error does (Knuth's TwoSum).
inline int compare_sum(double p, double q, double v) {
  const double sum = p + q;
  if (sum != v) return sum < v ? -1 : 1;
  const double shadow = sum - p;
  const double error = (p - (sum - shadow)) + (q - shadow);
  return error < 0 ? -1 : error > 0 ? 1 : 0;
}

}  // namespace tessera
