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
#include "core/material/sheen.h"
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

TEST(Layered, WithoutLayersIsMetallicRoughness) {
  for (int i = 0; i < 2000; ++i) {
    Random random(i);
    const auto unit = [&] { return i % 7 ? uniform_float(random) : float(random.bits() % 2); };
    const Rgb base{unit(), unit(), unit()};
    const float metallic = unit(), roughness = unit();
    const Bsdf layered = make_bsdf(Layered{base, metallic, roughness}, true);
    const Bsdf plain = make_bsdf(MetallicRoughness{base, metallic, roughness}, true);
    const Vec3 wo = random_up(random), wi = random_up(random);
    const BsdfValue got = evaluate(layered, wo, wi), want = evaluate(plain, wo, wi);
    expect_near(got.f_cos, want.f_cos, 1e-5 * (1 + largest(want.f_cos)));
    EXPECT_NEAR(got.pdf, want.pdf, 1e-5 * (1 + want.pdf));
    expect_near(albedo(layered, wo), albedo(plain, wo), 1e-5);
    const float u_lobe = uniform_float(random);
    const Vec2 u{uniform_float(random), uniform_float(random)};
    const auto drawn = sample(layered, wo, u_lobe, u), wanted = sample(plain, wo, u_lobe, u);
    ASSERT_EQ(drawn.has_value(), wanted.has_value());
    if (!wanted) continue;
    expect_near(drawn->wi, wanted->wi);
    EXPECT_EQ(drawn->is_delta, wanted->is_delta);
    expect_near(drawn->weight, wanted->weight, 1e-4 * (1 + largest(wanted->weight)));
    EXPECT_FALSE(drawn->transmits);
  }
}

/// What comes out of each delta lobe, by where it goes: mirrored, and passed straight or refracted.
struct Deltas {
  Rgb mirrored{}, passed{};
  Vec3 way{};

  Deltas(const Bsdf& bsdf, Vec3 wo) {
    // Over all of u_lobe: the mean of the weights of what is drawn is what the lobe sends back.
    constexpr int kSteps = 4096;
    for (int i = 0; i < kSteps; ++i) {
      const auto s = sample(bsdf, wo, (static_cast<float>(i) + 0.5F) / kSteps, {0.5F, 0.5F});
      if (!s || !s->is_delta) continue;
      Rgb& sum = s->transmits ? passed : mirrored;
      sum = sum + s->weight * (s->eta_scale / kSteps);
      if (s->transmits) way = s->wi;
    }
  }
};

double schlick_of(double f0, double cos_theta) { return f0 + (1 - f0) * std::pow(1 - cos_theta, 5); }

/// KHR_materials_transmission, with _ior and _specular: fresnel_mix, the passed part tinted by the base.
TEST(Layered, AClearSheetIsTheExtensions) {
  const Rgb base{0.9F, 0.5F, 0.1F};
  for (const double cos_theta : {1.0, 0.6, 0.2}) {
    const Vec3 wo = at_angle(cos_theta);
    const Layered sheet{.base_color = base,
                        .metallic = 0,
                        .roughness = 0,
                        .ior = 2,
                        .specular = 0.5F,
                        .specular_color = {1, 0.5F, 20},
                        .transmission = 0.75F};
    const Deltas got(make_bsdf(sheet, true), wo);
    const double f0 = 1.0 / 9;
    const auto fresnel = [&](double color) { return 0.5 * schlick_of(std::min(f0 * color, 1.0), cos_theta); };
    expect_near(got.mirrored, {float(fresnel(1)), float(fresnel(0.5)), float(fresnel(20))}, 1e-3);
    expect_near(got.passed, base * float(0.75 * (1 - fresnel(20))), 1e-3);
    expect_near(got.way, -wo);
  }
}

/// KHR_materials_transmission: the highlight's lobe, seen through the sheet, and the metal lets nothing pass.
TEST(Layered, ARoughSheetIsTheHighlightBehindIt) {
  const Layered sheet{.metallic = 0.25F, .roughness = 0.5F, .specular = 0, .transmission = 1};
  const Layered white_metal{.metallic = 1, .roughness = 0.5F};
  const Bsdf behind = make_bsdf(sheet, true), before = make_bsdf(white_metal, true);
  for (int i = 0; i < 300; ++i) {
    Random random(i);
    const Vec3 wo = random_up(random), wi = random_up(random);
    const float want = 0.75F * evaluate(before, wo, wi).f_cos.g;
    EXPECT_NEAR(evaluate(behind, wo, {wi.x, wi.y, -wi.z}).f_cos.g, want, 1e-4 * want);
  }
}

TEST(Layered, GlassIsADielectric) {
  for (int i = 0; i < 1000; ++i) {
    Random random(i);
    const Rgb tint{0.9F, 0.5F, 0.1F};
    const auto ior = static_cast<float>(random.uniform(1, 2.5));
    const float roughness = i % 3 ? uniform_float(random) : 0;
    const bool entering = i % 2 == 0;
    const Layered layered{
        .base_color = tint, .metallic = 0, .roughness = roughness, .ior = ior, .transmission = 1, .thin = false};
    const Bsdf got = make_bsdf(layered, entering);
    const Bsdf want = make_bsdf(Dielectric{ior, roughness, tint}, entering);
    const Vec3 wo = random_up(random);
    const float u_lobe = uniform_float(random);
    const Vec2 u{uniform_float(random), uniform_float(random)};
    const auto drawn = sample(got, wo, u_lobe, u), wanted = sample(want, wo, u_lobe, u);
    ASSERT_EQ(drawn.has_value(), wanted.has_value());
    if (!wanted) continue;
    expect_near(drawn->wi, wanted->wi);
    EXPECT_EQ(drawn->eta_scale, wanted->eta_scale);
    expect_near(drawn->weight, wanted->weight, 4e-3 * (1 + largest(wanted->weight)));
  }
}

/// KHR_materials_volume beside _specular: both ends of the Fresnel term are scaled, but total reflection stays total.
TEST(Layered, TotalReflectionInGlassIsTotalWhateverItsSpecular) {
  const Layered glass{.metallic = 0,
                      .roughness = 0,
                      .specular = 0.25F,
                      .specular_color = {1, 0.5F, 0},
                      .transmission = 1,
                      .thin = false};
  const Deltas beyond(make_bsdf(glass, false), at_angle(0.3));
  expect_near(beyond.mirrored, {1, 1, 1}, 1e-5);
  const Deltas straight(make_bsdf(glass, true), kUp);
  expect_near(straight.mirrored, {0.01F, 0.005F, 0}, 1e-4);
  expect_near(straight.passed, {0.99F, 0.99F, 0.99F}, 1e-3);
}

/// KHR_materials_clearcoat: mix(base, layer, clearcoat · fr(wo)).
TEST(Layered, TheCoatIsTheExtensions) {
  const Layered bare{.base_color = {0.9F, 0.5F, 0.1F}, .metallic = 0.5F, .roughness = 0.6F};
  Layered coated = bare;
  coated.clearcoat = 0.5F;
  for (int i = 0; i < 300; ++i) {
    Random random(i);
    const Vec3 wo = random_up(random), wi = random_up(random);
    const double weight = 0.5 * schlick_of(0.04, wo.z);
    const Rgb base = evaluate(make_bsdf(bare, true), wo, wi).f_cos;
    coated.clearcoat_roughness = 0;
    expect_near(evaluate(make_bsdf(coated, true), wo, wi).f_cos, base * float(1 - weight), 1e-5 * (1 + largest(base)));
    coated.clearcoat_roughness = 0.3F;
    const Rgb both = evaluate(make_bsdf(coated, true), wo, wi).f_cos;
    const double layer = appendix_highlight(wo, wi, 0.3, 1) * wi.z / ggx_albedo(wo.z, 0.3F).white;
    EXPECT_NEAR(both.g, base.g * (1 - weight) + weight * layer, 1e-3 * both.g);
  }
  const Deltas mirror(make_bsdf(Layered{.base_color = {}, .roughness = 1, .clearcoat = 1}, true), kUp);
  expect_near(mirror.mirrored, {0.04F, 0.04F, 0.04F}, 1e-5);
}

/// KHR_materials_sheen: sheenColor · sheen + base · min(1 - max3(sheenColor) E(wo), 1 - max3(sheenColor) E(wi)).
TEST(Layered, TheSheenIsTheExtensions) {
  const Layered bare{.base_color = {0.9F, 0.5F, 0.1F}, .metallic = 0, .roughness = 0.6F};
  Layered cloth = bare;
  cloth.sheen_color = {0.5F, 0.25F, 0.75F};
  cloth.sheen_roughness = 0.6F;
  for (int i = 0; i < 300; ++i) {
    Random random(i);
    const Vec3 wo = random_up(random), wi = random_up(random);
    const Rgb base = evaluate(make_bsdf(bare, true), wo, wi).f_cos;
    const float kept = 1 - 0.75F * std::max(sheen_albedo(wo.z, 0.6F), sheen_albedo(wi.z, 0.6F));
    const float sheen = Sheen(wo, 0.6F).evaluate(wo, wi);
    expect_near(evaluate(make_bsdf(cloth, true), wo, wi).f_cos, base * kept + cloth.sheen_color * sheen,
                1e-5 * (1 + largest(base)));
  }
}

/// KHR_materials_ior: an index of 0 is an infinite one.
TEST(Layered, AnIorOf0ReflectsAll) {
  const Bsdf bsdf = make_bsdf(Layered{.metallic = 0, .roughness = 0, .ior = 0}, true);
  for (const double cos_theta : {1.0, 0.5, 0.1})
    expect_near(Deltas(bsdf, at_angle(cos_theta)).mirrored, {1, 1, 1}, 1e-5);
}

}  // namespace
}  // namespace tessera
