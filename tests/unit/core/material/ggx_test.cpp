#include "core/material/ggx.h"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>

#include <gtest/gtest.h>

#include "tests/support/direction_test.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/statistics.h"
#include "tests/unit/core/material/bsdf_cases.h"

namespace tessera {
namespace {

/// Facets cover the surface that they make up.
TEST(Ggx, TheAreaOfFacetsSeenFromAboveIsOne) {
  for (const float alpha : {1e-4F, 1e-3F, 0.01F, 0.1F, 0.5F, 1.0F}) {
    double sum = 0;
    constexpr int kSteps = 20'000;  // over tan θ = alpha · s / (1 - s), which spreads every lobe alike
    for (int i = 0; i < kSteps; ++i) {
      const double s = (i + 0.5) / kSteps, tangent = alpha * s / (1 - s), cosine = 1 / std::sqrt(1 + tangent * tangent);
      const double slope = alpha / ((1 - s) * (1 - s)) / kSteps;  // d tan θ
      sum += Ggx{alpha}.density(to_float(Vec3d{tangent * cosine, 0, cosine})) * cosine * 2 * std::numbers::pi *
             tangent * cosine * cosine * cosine * slope;  // sin θ dθ = tan θ cos³ θ dtan θ
    }
    EXPECT_NEAR(sum, 1, 1e-3) << alpha;
  }
}

TEST(Ggx, MaskingIsSmiths) {
  for (int i = 0; i < 1000; ++i) {
    Random random(i);
    const double alpha = random.uniform(0.01, 1);
    const Vec3 wo = at_angle(random.uniform(0.01, 1)), wi = at_angle(random.uniform(0.01, 1), random.uniform(0, 6));
    const auto lambda = [&](Vec3 w) {
      const double cos2 = double{w.z} * w.z;
      return (std::sqrt(1 + alpha * alpha * (1 - cos2) / cos2) - 1) / 2;
    };
    const Ggx ggx{static_cast<float>(alpha)};
    EXPECT_NEAR(ggx.visible(wo) * wo.z * (1 + lambda(wo)), 1, 1e-5);
    EXPECT_NEAR(ggx.masked(wo, wi) * wo.z * (1 + lambda(wo) + lambda(wi)), 1, 1e-5);
    EXPECT_EQ(ggx.masked(wo, wi), ggx.masked(wo, {wi.x, wi.y, -wi.z}));
  }
}

TEST(Ggx, VisibleNormalsAreDrawnWithTheirDensity) {
  Random random(1);
  for (const float alpha : {0.1F, 0.4F, 1.0F})
    for (const double cos_theta : {1.0, 0.6, 0.2}) {
      const Ggx ggx{alpha};
      const Vec3 wo = at_angle(cos_theta);
      const DirectionTest test = test_directions(
          [&](int) {
            const float x = uniform_float(random), y = uniform_float(random);
            return std::optional(ggx.sample_visible(wo, {x, y}));
          },
          [&](Vec3 h) { return h.z > 0 ? ggx.density(h) * ggx.visible(wo) * std::max(dot(wo, h), 0.0F) : 0; },
          effort(20'000, 1'000'000), effort(16, 32), effort(32, 64));
      EXPECT_GE(test.fit.p, sidak(0.01, 9)) << alpha << ' ' << cos_theta;
      EXPECT_NEAR(test.integral, 1, 1e-3) << alpha << ' ' << cos_theta;
    }
}

TEST(Ggx, RoughnessBelowTheLeastIsNone) {
  EXPECT_EQ(effective_roughness(0), 0);
  EXPECT_EQ(effective_roughness(std::nextafter(kLeastRoughness, 0.0F)), 0);
  EXPECT_EQ(effective_roughness(kLeastRoughness), kLeastRoughness);
  EXPECT_EQ(effective_roughness(0.5F), 0.5F);
  EXPECT_EQ(effective_roughness(2), 1);
}

}  // namespace
}  // namespace tessera
