#include "core/material/ggx_albedo.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <numbers>

#include <gtest/gtest.h>

#include "core/material/ggx_albedo_tables.h"
#include "core/math/vec.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"

namespace tessera {
namespace {

/// What a single scattering keeps, written down a second time: in double, by the textbook's formulas, over a regular
/// grid of visible normals drawn from Heitz's map (2018) rather than ours.
class SingleScattering {
 public:
  SingleScattering(double cos_theta, double roughness, int steps)
      : alpha_(roughness * roughness), wo_{std::sqrt(1 - cos_theta * cos_theta), 0, cos_theta}, steps_(steps) {}

  double white() const {
    return mean([&](Vec3d h) { return mirrored(h); });
  }
  double schlick_mean() const {
    return mean([&](Vec3d h) { return std::pow(1 - dot(wo_, h), 5) * mirrored(h); }) / white();
  }
  double dielectric(double eta) const {
    return mean([&](Vec3d h) {
      const double c = dot(wo_, h), sin2_out = (1 - c * c) / (eta * eta);
      if (sin2_out >= 1) return mirrored(h);
      const double cos_out = std::sqrt(1 - sin2_out);
      const double across = (c - eta * cos_out) / (c + eta * cos_out),
                   along = (eta * c - cos_out) / (eta * c + cos_out);
      const double fresnel = (across * across + along * along) / 2;
      const Vec3d passed = (h * c - wo_) / eta - h * cos_out;
      return fresnel * mirrored(h) + (passed.z < 0 ? (1 - fresnel) * unmasked(passed) : 0);
    });
  }

 private:
  double lambda(Vec3d w) const {
    return (std::sqrt(1 + alpha_ * alpha_ * (w.x * w.x + w.y * w.y) / (w.z * w.z)) - 1) / 2;
  }
  double unmasked(Vec3d wi) const { return (1 + lambda(wo_)) / (1 + lambda(wo_) + lambda(wi)); }  // G2 / G1
  double mirrored(Vec3d h) const {
    const Vec3d wi = h * (2 * dot(wo_, h)) - wo_;
    return wi.z > 0 ? unmasked(wi) : 0;
  }

  template <class Kept>
  double mean(const Kept& kept) const {
    const Vec3d up{alpha_ * wo_.x / size(), 0, wo_.z / size()};
    const Vec3d across{0, 1, 0}, along{-up.z, 0, up.x};
    double sum = 0;
    for (int i = 0; i < steps_; ++i)
      for (int j = 0; j < steps_; ++j) {
        const double radius = std::sqrt((i + 0.5) / steps_),
                     phi = std::numbers::pi * (j + 0.5) / steps_ - std::numbers::pi / 2;
        // Even in the projection of the half sphere that is seen from `up`; both sides of the plane of incidence are
        // alike.
        const double y = radius * std::cos(phi), first = radius * std::sin(phi);
        const double share = (1 + up.z) / 2, x = (1 - share) * std::sqrt(1 - y * y) + share * first;
        const Vec3d h = across * y + along * x + up * std::sqrt(std::max(0.0, 1 - x * x - y * y));
        const Vec3d micro{alpha_ * h.x, alpha_ * h.y, std::max(h.z, 1e-12)};
        sum += kept(micro / length(micro));
      }
    return sum / (double(steps_) * steps_);
  }
  double size() const { return std::sqrt(alpha_ * alpha_ * wo_.x * wo_.x + wo_.z * wo_.z); }

  double alpha_;
  Vec3d wo_;
  int steps_;
};

/// Where the tables' numbers stand.
double node_cosine(std::size_t i, double roughness) {
  const double alpha = roughness * roughness, share = double(i) / (kTableCosines - 1);
  return std::clamp(share * alpha / (1 + alpha - share), 1e-6, 1.0);
}
double schlick_node_cosine(std::size_t i) {
  const double share = double(i) / (kTableCosines - 1);
  return std::clamp(share * share, 1e-6, 1.0);
}
double node_roughness(std::size_t i) {
  return kLeastRoughness + (1 - kLeastRoughness) * double(i) / (kTableRoughnesses - 1);
}
double node_eta(std::size_t i, bool to_denser) {
  const double share = std::max(double(i) / (kTableEtas - 1), 1e-2), difference = std::pow(share, 4) * 999 / 1001;
  const double eta = (1 + difference) / (1 - difference);
  return to_denser ? eta : 1 / eta;
}

template <class Albedo, class Cosine>
void print_slice(const Albedo& albedo, const Cosine& cosine) {
  constexpr int kSteps = 256;
  for (std::size_t r = 0; r < kTableRoughnesses; ++r) {
    std::printf("    \"");
    const double roughness = node_roughness(r);
    for (std::size_t c = 0; c < kTableCosines; ++c)
      std::printf("%04.0f", albedo(SingleScattering(cosine(c, roughness), roughness, kSteps)) * kTableOne);
    std::printf("\"\n");
  }
}

/// Prints core/material/ggx_albedo_tables.cpp below its first lines: `unit_core --gtest_also_run_disabled_tests
/// --gtest_filter=GgxAlbedo.DISABLED_PrintTables`.
TEST(GgxAlbedo, DISABLED_PrintTables) {
  std::printf("constexpr std::string_view kWhite =\n");
  print_slice([](const SingleScattering& s) { return s.white(); }, node_cosine);
  std::printf("    ;\nconstexpr std::string_view kSchlick =\n");
  print_slice([](const SingleScattering& s) { return s.schlick_mean(); },
              [](std::size_t i, double) { return schlick_node_cosine(i); });
  for (const bool to_denser : {false, true}) {
    std::printf("    ;\nconstexpr std::string_view %s =\n", to_denser ? "kToDenser" : "kToLessDense");
    for (std::size_t e = 0; e < kTableEtas; ++e)
      print_slice([&](const SingleScattering& s) { return s.dielectric(node_eta(e, to_denser)); }, node_cosine);
  }
  std::printf("    ;\n");
}

/// Over angles down to half a degree above the horizon, roughnesses, and indices of refraction.
TEST(GgxAlbedo, TablesAreWithinAPercentOfTheIntegralAndCloserOnTheWhole) {
  double white_sum = 0, dielectric_sum = 0;
  const int count = effort(200, 2000);
  for (int i = 0; i < count; ++i) {
    Random random(i);
    const double cos_theta = std::sin(random.uniform(0.01, 1.57)), roughness = random.uniform(kLeastRoughness, 1);
    const double eta = i % 2 ? random.uniform(1.2, 2.5) : 1 / random.uniform(1.2, 2.5);
    const SingleScattering exact(cos_theta, roughness, 128);
    const auto got = ggx_albedo(static_cast<float>(cos_theta), static_cast<float>(roughness));
    const double white = std::abs(got.white / exact.white() - 1);
    const double dielectric = std::abs(
        dielectric_albedo(static_cast<float>(cos_theta), static_cast<float>(roughness), static_cast<float>(eta)) /
            exact.dielectric(eta) -
        1);
    EXPECT_LE(white, 0.01) << i;
    EXPECT_NEAR(got.schlick_mean, exact.schlick_mean(), 0.005) << i;
    EXPECT_LE(dielectric, 0.01) << i;
    white_sum += white;
    dielectric_sum += dielectric;
  }
  EXPECT_LE(white_sum / count, 1e-3);
  EXPECT_LE(dielectric_sum / count, 1e-3);
}

}  // namespace
}  // namespace tessera
