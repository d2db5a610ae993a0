// What each kind of surface is by its own definition.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <gtest/gtest.h>

#include "core/material/bsdf.h"
#include "core/material/fresnel.h"
#include "core/material/ggx_albedo.h"
#include "core/material/shade.h"
#include "tests/support/random.h"
#include "tests/unit/core/material/bsdf_cases.h"

namespace tessera {
namespace {

constexpr Vec3 kUp{0, 0, 1};
constexpr float kFirst = 0, kLast = 0x1.fffffep-1F;  // the first and the last lobe

void expect_near(Rgb got, Rgb want, double tolerance) {
  EXPECT_NEAR(got.r, want.r, tolerance);
  EXPECT_NEAR(got.g, want.g, tolerance);
  EXPECT_NEAR(got.b, want.b, tolerance);
}

void expect_near(Vec3 got, Vec3 want) { EXPECT_LE(length(got - want), 1e-5F); }

Vec3 random_up(Random& random) { return at_angle(random.uniform(0.01, 1), random.uniform(0, 6)); }

TEST(WhittedSurface, IsShadesFormulaToTheBit) {
  const WhittedSurface surface{.diffuse = {0.2F, 0.5F, 0.7F}, .specular = {0.9F, 0.8F, 0.7F}, .shininess = 17};
  const Bsdf bsdf = make_bsdf(surface, true);
  for (int i = 0; i < 1000; ++i) {
    Random random(i);
    const Vec3 wo = random_up(random), wi = random_up(random);
    EXPECT_EQ(evaluate(bsdf, wo, wi).f_cos, shade(surface, kUp, wo, wi, {1, 1, 1}));
  }
}

TEST(WhittedSurface, ItsDeltasAreWhatWhittedTraces) {
  for (int i = 0; i < 1000; ++i) {
    Random random(i);
    const WhittedSurface surface{.diffuse = {},
                                 .reflect = {0.5F, 0.4F, 0.3F},
                                 .transmit = {0.9F, 0.6F, 0.1F},
                                 .ior = static_cast<float>(random.uniform(0.5, 2)),
                                 .fresnel = i % 2 == 0};
    const bool entering = random.bits() % 2 == 0;
    const float eta = entering ? surface.ior : 1 / surface.ior;
    const Bsdf bsdf = make_bsdf(surface, entering);
    const Vec3 wo = random_up(random);
    const float reflected = surface.fresnel ? fresnel(-wo, kUp, eta) : 1;

    const auto mirrored = sample(bsdf, wo, kFirst, {});
    ASSERT_TRUE(mirrored && mirrored->is_delta && !mirrored->transmits);
    expect_near(mirrored->wi, mirror(-wo, kUp));
    expect_near(mirrored->weight * mirrored->pdf, surface.reflect * reflected, 1e-4);

    const auto passed = sample(bsdf, wo, kLast, {});
    const auto bent = refract(-wo, kUp, eta);
    ASSERT_TRUE(passed && passed->is_delta);
    ASSERT_EQ(passed->transmits, bent.has_value());
    if (!bent) continue;
    expect_near(passed->wi, *bent);
    expect_near(passed->weight * passed->pdf, surface.transmit * (surface.fresnel ? 1 - reflected : 1), 1e-4);
    EXPECT_EQ(passed->eta_scale, 1);
  }
}

TEST(Conductor, SmoothIsAMirrorThatFresnelDims) {
  const Conductor gold{{0.143F, 0.375F, 1.442F}, {3.983F, 2.386F, 1.603F}};
  for (const double cos_theta : {1.0, 0.5, 0.01}) {
    const Vec3 wo = at_angle(cos_theta);
    const auto s = sample(make_bsdf(gold, true), wo, 0.5F, {0.5F, 0.5F});
    ASSERT_TRUE(s && s->is_delta);
    EXPECT_EQ(s->wi, Vec3({-wo.x, -wo.y, wo.z}));
    EXPECT_EQ(s->weight, conductor_fresnel(wo.z, gold.eta, gold.k));
  }
}

TEST(Dielectric, SmoothReflectsAndRefractsByFresnelAndScalesRadiance) {
  const Rgb tint{0.9F, 0.5F, 0.1F};
  for (int i = 0; i < 1000; ++i) {
    Random random(i);
    const auto ior = static_cast<float>(random.uniform(0.4, 2.5));
    const bool entering = random.bits() % 2 == 0;
    const float eta = entering ? ior : 1 / ior;
    const Bsdf bsdf = make_bsdf(Dielectric{ior, 0, tint}, entering);
    const Vec3 wo = random_up(random);
    const float reflected = fresnel(-wo, kUp, eta);

    const auto mirrored = sample(bsdf, wo, kFirst, {});
    ASSERT_TRUE(mirrored && mirrored->is_delta && !mirrored->transmits);
    expect_near(mirrored->wi, mirror(-wo, kUp));
    expect_near(mirrored->weight * mirrored->pdf, Rgb{1, 1, 1} * reflected, 1e-4);

    const auto passed = sample(bsdf, wo, kLast, {});
    const auto bent = refract(-wo, kUp, eta);
    ASSERT_EQ(passed->transmits, bent.has_value());
    if (!bent) continue;
    expect_near(passed->wi, *bent);
    expect_near(passed->weight * passed->pdf, tint * ((1 - reflected) / (eta * eta)), 1e-3);
    EXPECT_EQ(passed->eta_scale, eta * eta);
  }
}

TEST(Dielectric, BlackGlassOnlyReflects) {
  for (const float roughness : {0.0F, 0.5F})
    for (int i = 0; i < 200; ++i) {
      Random random(i);
      const auto s = draw(make_bsdf(Dielectric{1.5F, roughness, {}}, true), random_up(random), random);
      EXPECT_FALSE(s && s->transmits);
    }
}

/// glTF 2.0, appendix B: D · V · F with V of the height-correlated Smith.
double appendix_highlight(Vec3 wo, Vec3 wi, double roughness, double f0) {
  const Vec3d v = to_double(wo), l = to_double(wi), sum = v + l, h = sum / length(sum);
  const double a2 = std::pow(roughness, 4), d = a2 / (std::numbers::pi * std::pow(h.z * h.z * (a2 - 1) + 1, 2));
  const double visibility =
      0.5 / (l.z * std::sqrt(v.z * v.z * (1 - a2) + a2) + v.z * std::sqrt(l.z * l.z * (1 - a2) + a2));
  return (f0 + (1 - f0) * std::pow(1 - dot(v, h), 5)) * d * visibility;
}

TEST(MetallicRoughness, MetalIsTheAppendixButForWhatScattersTwice) {
  const Rgb base{0.9F, 0.5F, 0.1F};
  for (const float roughness : {0.2F, 0.5F, 1.0F}) {
    const Bsdf bsdf = make_bsdf(MetallicRoughness{base, 1, roughness}, true);
    for (int i = 0; i < 300; ++i) {
      Random random(i);
      const Vec3 wo = random_up(random), wi = random_up(random);
      const double lost = 1 / ggx_albedo(wo.z, roughness).white - 1;
      const Rgb got = evaluate(bsdf, wo, wi).f_cos;
      const auto want = [&](double f0) { return appendix_highlight(wo, wi, roughness, f0) * wi.z * (1 + f0 * lost); };
      ASSERT_NEAR(got.r, want(base.r), 1e-3 * want(base.r));
      ASSERT_NEAR(got.g, want(base.g), 1e-3 * want(base.g));
      ASSERT_NEAR(got.b, want(base.b), 1e-3 * want(base.b));
    }
  }
}

/// Where coat and base share light as the appendix has it, (1 - F) of half the angle, within a few percent.
TEST(MetallicRoughness, PlasticIsCloseToTheAppendix) {
  const double base = 0.6;
  for (const float roughness : {0.3F, 0.6F}) {
    const Bsdf bsdf = make_bsdf(MetallicRoughness{Rgb{1, 1, 1} * 0.6F, 0, roughness}, true);
    for (int i = 0; i < 300; ++i) {
      Random random(i);
      const Vec3 wo = at_angle(random.uniform(0.6, 1)), wi = at_angle(random.uniform(0.6, 1), random.uniform(0, 6));
      const Vec3 sum = wo + wi;
      const double fresnel = 0.04 + 0.96 * std::pow(1 - dot(wo, sum) / length(sum), 5);
      const double want =
          (base * (1 - fresnel) / std::numbers::pi + appendix_highlight(wo, wi, roughness, 0.04)) * wi.z;
      ASSERT_NEAR(evaluate(bsdf, wo, wi).f_cos.r, want, 0.06 * want);
    }
  }
}

TEST(MetallicRoughness, SmoothIsAMirrorOverABase) {
  const Bsdf bsdf = make_bsdf(MetallicRoughness{{0.8F, 0.4F, 0.2F}, 0, 0}, true);
  const auto s = sample(bsdf, kUp, kFirst, {0.5F, 0.5F});
  ASSERT_TRUE(s && s->is_delta);
  EXPECT_EQ(s->wi, kUp);
  expect_near(s->weight * s->pdf, {0.04F, 0.04F, 0.04F}, 1e-6);
  EXPECT_FALSE(sample(bsdf, kUp, kLast, {0.5F, 0.5F})->is_delta);
  // Straight on the base gets 0.96 of the light, and what leaves it obliquely loses what the coat reflects there.
  expect_near(albedo(bsdf, kUp), {0.04F + 0.8F * 0.96F, 0.04F + 0.4F * 0.96F, 0.04F + 0.2F * 0.96F}, 1e-5);
}

}  // namespace
}  // namespace tessera
