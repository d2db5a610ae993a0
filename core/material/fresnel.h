#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/math/rgb.h"

namespace tessera {

/// The share of unpolarised light that a dielectric reflects; 1 at total internal reflection. `cos_in` is in [0, 1],
/// and `sin2_in` = 1 - cos_in², which a caller may know with more digits; `eta` is the index of the far side relative
/// to the near one, > 0.
inline float dielectric_fresnel(float cos_in, float sin2_in, float eta) {
  const float sin2_out = sin2_in / (eta * eta);
  if (sin2_out >= 1) return 1;
  const float cos_out = std::sqrt(1 - sin2_out);
  const float parallel = (eta * cos_in - cos_out) / (eta * cos_in + cos_out);
  const float across = (cos_in - eta * cos_out) / (cos_in + eta * cos_out);
  return (parallel * parallel + across * across) / 2;
}

/// The same of a conductor of index eta - i k, in the form of Born & Wolf 1999, § 14.2, arranged so that nothing
/// cancels. `cos_in` is in [0, 1], eta and k in [0, 1e4].
inline float conductor_fresnel(float cos_in, float eta, float k) {
  const float cos2 = cos_in * cos_in, sin2 = std::max(1 - cos2, 0.0F);
  // (a + ib)² = (eta - ik)² - sin²; of a² and b² the larger is computed, and the other follows from their product.
  const float difference = (eta - k) * (eta + k) - sin2, product = eta * k;
  const float sum = std::sqrt(difference * difference + 4 * product * product);
  const float larger = std::max((sum + std::abs(difference)) / 2, std::numeric_limits<float>::min());
  const float a = difference > 0 ? std::sqrt(larger) : product / std::sqrt(larger);
  const float across_of = sum + cos2, across_by = 2 * a * cos_in;
  const float across = (across_of - across_by) / std::max(across_of + across_by, std::numeric_limits<float>::min());
  const float parallel_of = cos2 * sum + sin2 * sin2, parallel_by = across_by * sin2;
  const float ratio =
      (parallel_of - parallel_by) / std::max(parallel_of + parallel_by, std::numeric_limits<float>::min());
  return std::clamp(across * (1 + ratio) / 2, 0.0F, 1.0F);
}

inline Rgb conductor_fresnel(float cos_in, Rgb eta, Rgb k) {
  return {conductor_fresnel(cos_in, eta.r, k.r), conductor_fresnel(cos_in, eta.g, k.g),
          conductor_fresnel(cos_in, eta.b, k.b)};
}

/// (1 - cos θ)^5: how far Schlick's approximation (1994) has gone from the reflectance at normal incidence to 1.
inline float schlick(float cos_in) {
  const float rest = std::max(1 - cos_in, 0.0F), square = rest * rest;
  return square * square * rest;
}

/// 2 ∫ f(cos θ) cos θ dcos θ: the mean over a hemisphere of even light of something like a Fresnel term, a float or an
/// Rgb, by three points of Gauss and Jacobi (exact for polynomials up to the fifth degree).
template <class F>
auto hemisphere_mean(const F& f) {
  return f(0.21234054F) * 0.13965396F + f(0.59053314F) * 0.45848221F + f(0.91141204F) * 0.40186383F;
}

}  // namespace tessera
