#include "core/material/fresnel.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

float fresnel_at(double cos_in, double eta) {
  return dielectric_fresnel(static_cast<float>(cos_in), static_cast<float>(1 - cos_in * cos_in),
                            static_cast<float>(eta));
}

TEST(Fresnel, DielectricsAtKnownAngles) {
  EXPECT_NEAR(fresnel_at(1, 1.5), 0.04, 1e-7);
  EXPECT_NEAR(fresnel_at(1, 1 / 1.5), 0.04, 1e-7);
  EXPECT_NEAR(fresnel_at(1e-6, 1.5), 1, 1e-4);
  EXPECT_EQ(fresnel_at(0, 1.5), 1);
  // At Brewster's angle, tan θ = eta, what is polarised in the plane of incidence isn't reflected.
  const double cos_brewster = 1 / std::sqrt(1 + 1.5 * 1.5), across = (1 - 1.5 * 1.5) / (1 + 1.5 * 1.5);
  EXPECT_NEAR(fresnel_at(cos_brewster, 1.5), across * across / 2, 1e-6);
  // Total internal reflection: sin θ > eta.
  EXPECT_EQ(fresnel_at(std::cos(std::asin(1 / 1.5) + 1e-4), 1 / 1.5), 1);
  EXPECT_LT(fresnel_at(std::cos(std::asin(1 / 1.5) - 1e-4), 1 / 1.5), 1);
  EXPECT_EQ(fresnel_at(0.9, 1e-3), 1);
}

/// As the textbooks write it.
double complex_fresnel(double cos_in, std::complex<double> index) {
  const std::complex<double> cos_out = std::sqrt(1.0 - (1 - cos_in * cos_in) / (index * index));
  const auto across = (cos_in - index * cos_out) / (cos_in + index * cos_out);
  const auto along = (index * cos_in - cos_out) / (index * cos_in + cos_out);
  return (std::norm(across) + std::norm(along)) / 2;
}

TEST(Fresnel, ConductorsAreAsComplexNumbersHaveThem) {
  for (int i = 0; i < 100'000; ++i) {
    Random random(i);
    const double cos_in = i % 10 ? random.uniform(0, 1) : random.magnitude(-6, 0);
    // Metals; and without absorption what has no critical angle, where all digits would hang on the last one of cos_in.
    const auto c = static_cast<float>(cos_in), k = static_cast<float>(i % 3 ? random.magnitude(-1, 2) : 0),
               eta = static_cast<float>(random.magnitude(k > 0 ? -2 : 0, 1.5));
    ASSERT_NEAR(conductor_fresnel(c, eta, k), complex_fresnel(c, {eta, -k}), 1e-5) << c << ' ' << eta << ' ' << k;
  }
}

/// What the index of a metal of a given colour (eta 1, k as pbrt-v4 has it) reflects straight on.
TEST(Fresnel, ConductorsOfAColour) {
  for (const float r : {0.0F, 0.1F, 0.5F, 0.9F, 0.9999F})
    EXPECT_NEAR(conductor_fresnel(1, 1, 2 * std::sqrt(r) / std::sqrt(1 - r)), r, 1e-6);
}

TEST(Fresnel, HemisphereMeanIsTheIntegral) {
  for (const float k : {1.0F, 3.0F, 10.0F}) {
    double sum = 0;
    constexpr int kSteps = 20'000;
    for (int i = 0; i < kSteps; ++i) {
      const double c = (i + 0.5) / kSteps;
      sum += 2 * c * complex_fresnel(c, {0.5, -double{k}}) / kSteps;
    }
    EXPECT_NEAR(hemisphere_mean([&](float c) { return conductor_fresnel(c, 0.5F, k); }), sum, 2e-3);
  }
  EXPECT_NEAR(hemisphere_mean([](float c) { return schlick(c); }), 1.0 / 21, 1e-6);
}

}  // namespace
}  // namespace tessera
