#include "core/material/sheen.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <numbers>

#include <gtest/gtest.h>

#include "core/material/sheen_table.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/core/material/bsdf_cases.h"

namespace tessera {
namespace {

/// KHR_materials_sheen's formulas, written down a second time, in double.
class Appendix {
 public:
  explicit Appendix(double roughness) : alpha_(roughness * roughness) {}

  double f(Vec3d v, Vec3d l) const {
    const Vec3d sum = v + l;
    const double cos_h = sum.z / length(sum);
    return density(cos_h) / ((1 + lambda(v.z) + lambda(l.z)) * 4 * v.z * l.z);
  }
  double density(double cos_h) const {
    const double exponent = 1 / alpha_;
    return (2 + exponent) * std::pow(std::max(1 - cos_h * cos_h, 0.0), exponent / 2) / (2 * std::numbers::pi);
  }
  double lambda(double x) const { return x < 0.5 ? std::exp(l(x)) : std::exp(2 * l(0.5) - l(1 - x)); }

  /// By steps that grow with the square of cos θ: most comes from along the horizon.
  double albedo(double cos_theta, int steps) const {
    const Vec3d v{std::sqrt(1 - cos_theta * cos_theta), 0, cos_theta};
    double sum = 0;
    for (int i = 0; i < steps; ++i)
      for (int j = 0; j < steps; ++j) {
        const double root = (i + 0.5) / steps, z = root * root, phi = (j + 0.5) / steps * std::numbers::pi;
        const double s = std::sqrt(1 - z * z);
        sum += f(v, {s * std::cos(phi), s * std::sin(phi), z}) * z * 2 * root;
      }
    return sum * 2 * std::numbers::pi / (double(steps) * steps);
  }

 private:
  double l(double x) const {
    const double t = (1 - alpha_) * (1 - alpha_);
    const auto mix = [&](double one, double other) { return one * (1 - t) + other * t; };
    return mix(21.5473, 25.3245) / (1 + mix(3.82987, 3.32435) * std::pow(x, mix(0.19823, 0.16801))) +
           mix(-1.97760, -1.27393) * x + mix(-4.32054, -4.85967);
  }
  double alpha_;
};

/// Prints the numbers of core/material/sheen_table.cpp: `unit_core --gtest_also_run_disabled_tests
/// --gtest_filter=Sheen.DISABLED_PrintTable`.
TEST(Sheen, DISABLED_PrintTable) {
  for (std::size_t r = 0; r < kSheenRoughnesses; ++r) {
    const double share = double(r) / (kSheenRoughnesses - 1);
    const Appendix sheen(kLeastSheenRoughness + (1 - kLeastSheenRoughness) * share * share);
    std::printf("    {{");
    for (std::size_t c = 0; c < kSheenCosines; ++c)
      std::printf(
          "%s%.0f", c ? ", " : "",
          sheen.albedo(std::max(std::pow(double(c) / (kSheenCosines - 1), 4), 1e-4), 400) * double{kSheenTableOne});
    std::printf("}},\n");
  }
}

TEST(Sheen, TableIsTheIntegral) {
  for (int i = 0; i < effort(60, 1000); ++i) {
    Random random(i);
    const double roughness = random.uniform(kLeastSheenRoughness, 1), cos_theta = std::sin(random.uniform(0.002, 1.57));
    const double want = std::min(Appendix(roughness).albedo(cos_theta, 150), 1.0);
    EXPECT_NEAR(sheen_albedo(float(cos_theta), float(roughness)), want, 0.01) << roughness << ' ' << cos_theta;
  }
}

/// All fibres together cover the plane once.
TEST(Sheen, TheDistributionIsNormalised) {
  for (const double roughness : {0.1, 0.3, 0.7, 1.0}) {
    constexpr int kSteps = 100'000;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double cos_h = (i + 0.5) / kSteps;
      sum += Appendix(roughness).density(cos_h) * cos_h * 2 * std::numbers::pi / kSteps;
    }
    EXPECT_NEAR(sum, 1, 1e-4) << roughness;
  }
}

TEST(Sheen, IsTheAppendixWhereThatKeepsEnergy) {
  for (int i = 0; i < 2000; ++i) {
    Random random(i);
    const double roughness = random.uniform(0.3, 1);
    const Vec3 wo = at_angle(random.uniform(0.01, 1), random.uniform(0, 6)),
               wi = at_angle(random.uniform(0.01, 1), random.uniform(0, 6));
    const double want = Appendix(roughness).f(to_double(wo), to_double(wi)) * wi.z;
    EXPECT_NEAR(Sheen(wo, float(roughness)).evaluate(wo, wi), want, 1e-4 * want + 1e-9);
  }
}

TEST(Sheen, BelowTheLeastRoughnessItIsAsThere) {
  const Vec3 wo = at_angle(0.1), wi = at_angle(0.05, 2);
  const float least = Sheen(wo, kLeastSheenRoughness).evaluate(wo, wi);
  EXPECT_GT(least, 0);
  for (const float roughness : {0.0F, 1e-30F, 0.05F}) EXPECT_EQ(Sheen(wo, roughness).evaluate(wo, wi), least);
}

}  // namespace
}  // namespace tessera
