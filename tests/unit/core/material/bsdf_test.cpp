#include "core/material/bsdf.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "core/material/ggx_albedo.h"
#include "tests/support/direction_test.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/statistics.h"
#include "tests/unit/core/material/bsdf_cases.h"

namespace tessera {
namespace {

constexpr double kCosines[] = {0.98, 0.6, 0.2};

bool is_sound(Rgb c) { return is_finite(c) && c.r >= 0 && c.g >= 0 && c.b >= 0; }

/// A direction from anywhere, often almost along the horizon, and as rounding leaves it.
Vec3 any_direction(Random& random, bool above) {
  Vec3d d = random.direction();
  if (random.bits() % 3 == 0) d.z *= random.magnitude(-46, 0);
  if (random.bits() % 8 == 0) d = {d.x * random.magnitude(-40, -3), d.y * random.magnitude(-40, -3), d.z};
  d = d / length(d);
  return to_float(above ? Vec3d{d.x, d.y, std::abs(d.z)} : d);
}

Bsdf any_bsdf(Random& random) {
  const auto unit = [&] {
    constexpr float kExtremes[] = {0, 1, 1e-3F, 1e-30F, 0.0099F, 0.01F, 0.0101F};
    return random.bits() % 2 ? kExtremes[random.bits() % std::size(kExtremes)] : uniform_float(random);
  };
  const auto color = [&] { return Rgb{unit(), unit(), unit()}; };
  const auto index = [&](double low, double high) {
    constexpr float kExtremes[] = {1, 1e-3F, 1e3F, 1.00001F, 0.9999F, 1.5F};
    return random.bits() % 2 ? kExtremes[random.bits() % std::size(kExtremes)] : float(random.magnitude(low, high));
  };
  const auto indices = [&] {
    return random.bits() % 4 ? Rgb{index(-6, 6), index(-6, 6), index(-6, 6)} : Rgb{0, unit(), 200};
  };
  Material m;
  switch (random.bits() % 6) {
    case 0:
      m.surface = WhittedSurface{color(), color(),      float(random.magnitude(-2, 6)), color(),
                                 color(), index(-3, 3), random.bits() % 2 == 0};
      break;
    case 1:
      m.surface = Diffuse{color()};
      break;
    case 2:
      m.surface = Conductor{indices(), indices(), unit()};
      break;
    case 3:
      m.surface = Dielectric{index(-3, 3), unit(), color()};
      break;
    case 4:
      m.surface = MetallicRoughness{color(), unit(), unit()};
      break;
    default:
      m.surface = Layered{.base_color = color(),
                          .metallic = unit(),
                          .roughness = unit(),
                          .ior = random.bits() % 8 ? index(-3, 3) : 0,
                          .specular = unit(),
                          .specular_color = color() * (random.bits() % 2 ? 1.0F : 100.0F),
                          .transmission = unit(),
                          .thin = random.bits() % 2 == 0,
                          .clearcoat = unit(),
                          .clearcoat_roughness = unit(),
                          .sheen_color = random.bits() % 2 ? Rgb{} : color(),
                          .sheen_roughness = unit()};
  }
  return make_bsdf(m.surface, random.bits() % 2 == 0);
}

TEST(Bsdf, EveryKindHasExamples) {
  std::set<std::size_t> kinds;
  for (const BsdfCase& c : bsdf_cases()) {
    EXPECT_EQ(c.material.surface.index(), c.bsdf().index()) << c.name;
    kinds.insert(c.bsdf().index());
  }
  EXPECT_EQ(kinds.size(), std::variant_size_v<Surface>);
}

/// χ²; what the density lacks to 1 is what is drawn as a delta or lost.
TEST(Bsdf, DirectionsAreDrawnWithTheDensityThatEvaluateGives) {
  const auto cases = bsdf_cases();
  const double level = sidak(0.01, static_cast<double>(cases.size() * std::size(kCosines)));
  int turn = 0;
  for (const BsdfCase& c : cases)
    for (const double cos_theta : kCosines) {
      Random random(++turn);
      if (!long_tests() && turn % 4 != 0) continue;  // every kind and every angle, but not each with each
      const Bsdf bsdf = c.bsdf();
      const Vec3 wo = at_angle(cos_theta);
      const auto direction = [&](int) -> std::optional<Vec3> {
        const auto s = draw(bsdf, wo, random);
        return s && !s->is_delta ? std::optional(s->wi) : std::nullopt;
      };
      const auto density = [&](Vec3 wi) { return evaluate(bsdf, wo, wi).pdf; };
      const DirectionTest test =
          test_directions(direction, density, effort(30'000, 1'000'000), effort(16, 32), effort(32, 64));
      EXPECT_GE(test.fit.p, level) << c.name << " at " << cos_theta << ", density " << test.integral;
      EXPECT_LE(test.integral, 1.0005) << c.name << " at " << cos_theta;
    }
}

TEST(Bsdf, WeightsAreFByTheDensity) {
  for (const BsdfCase& c : bsdf_cases())
    for (int i = 0; i < 3000; ++i) {
      Random random(i);
      const Bsdf bsdf = c.bsdf();
      const Vec3 wo = at_angle(random.uniform(0.01, 1), random.uniform(0, 6));
      const auto s = draw(bsdf, wo, random);
      if (!s) continue;
      ASSERT_EQ(s->transmits, s->wi.z < 0) << c.name;
      ASSERT_NEAR(length(s->wi), 1, 1e-5) << c.name;
      const BsdfValue value = evaluate(bsdf, wo, s->wi);
      if (s->is_delta) {
        ASSERT_LE(s->pdf, 1) << c.name;
        continue;
      }
      const auto expect_near = [&](float got, float want) { ASSERT_NEAR(got, want, 0.004 * want + 1e-6) << c.name; };
      expect_near(value.pdf, s->pdf);
      expect_near(value.f_cos.r, s->weight.r * s->pdf);
      expect_near(value.f_cos.g, s->weight.g * s->pdf);
      expect_near(value.f_cos.b, s->weight.b * s->pdf);
    }
}

TEST(Bsdf, WhereItSaysThatNothingIsSmoothEvaluateIsBlack) {
  for (const BsdfCase& c : bsdf_cases()) {
    bool seen = false, seen_behind = false;
    for (int i = 0; i < 1000; ++i) {
      Random random(i);
      const Vec3 wi = any_direction(random, false);
      const bool is_black = evaluate(c.bsdf(), any_direction(random, true), wi).f_cos.is_black();
      seen |= !is_black;
      seen_behind |= !is_black && wi.z < 0;
    }
    EXPECT_EQ(seen, has_smooth_lobes(c.bsdf())) << c.name;
    EXPECT_EQ(seen_behind, has_smooth_transmission(c.bsdf())) << c.name;
  }
}

TEST(Bsdf, NothingComesBackFromBehindTheSurface) {
  for (const BsdfCase& c : bsdf_cases())
    for (int i = 0; i < 200; ++i) {
      Random random(i);
      Vec3 wo = any_direction(random, true);
      wo.z = i % 2 ? 0 : -wo.z;
      EXPECT_FALSE(draw(c.bsdf(), wo, random)) << c.name;
      EXPECT_TRUE(evaluate(c.bsdf(), wo, any_direction(random, false)).f_cos.is_black()) << c.name;
    }
}

/// The most that f(wo, wi) of a layered surface may be of f(wi, wo): by the lobe whose factor of wo does most.
double most_of_reverse(const Layered& s, Vec3 wo, Vec3 wi) {
  const auto coat = [&](Vec3 w) { return s.clearcoat * (0.04 + 0.96 * std::pow(1.0 - w.z, 5)); };
  const auto white = [&](Vec3 w, float roughness) { return roughness > 0 ? ggx_albedo(w.z, roughness).white : 1; };
  double most = 1 / white(wo, s.roughness);
  if (!s.thin && s.roughness > 0)
    for (const float eta : {s.ior, 1 / s.ior}) {
      const double there = dielectric_albedo(wo.z, s.roughness, eta), back = dielectric_albedo(wi.z, s.roughness, eta);
      // Where `specular` changes it, the scale is between those of all and of nothing given back.
      most = std::max(most, s.specular < 1 ? 1 / std::min(there, back) : back / there);
    }
  most = std::max(most * (1 - coat(wo)) / (1 - coat(wi)), most);
  if (s.clearcoat > 0 && s.clearcoat_roughness > 0)
    most = std::max(most, coat(wo) / coat(wi) * white(wi, s.clearcoat_roughness) / white(wo, s.clearcoat_roughness));
  // Seen along the horizon a sheen of little roughness is scaled down.
  if (!s.sheen_color.is_black() && s.sheen_roughness < 0.25F) most *= 1.6;
  return most;
}

/// f(a, b) / f(b, a) = g(a) / g(b), and with a third direction g falls out.
TEST(Bsdf, ReflectionIsReciprocal) {
  for (const BsdfCase& c : bsdf_cases()) {
    if (std::holds_alternative<WhittedSurface>(c.material.surface)) continue;  // Phong's highlight isn't.
    const Bsdf bsdf = c.bsdf();
    const auto f = [&](Vec3 wo, Vec3 wi) { return double(evaluate(bsdf, wo, wi).f_cos.r) / wi.z; };
    for (int i = 0; i < 500; ++i) {
      Random random(i);
      Vec3 d[3];
      for (Vec3& v : d) v = at_angle(random.uniform(0.05, 1), random.uniform(0, 6));
      if (c.is_reciprocal) {
        ASSERT_NEAR(f(d[0], d[1]), f(d[1], d[0]), 1e-4 * f(d[0], d[1])) << c.name;
      } else if (std::holds_alternative<MetallicRoughness>(c.material.surface)) {
        // Of its lobes only the highlight has the factor, of at most 1 + f0 (1 / E - 1).
        const float roughness = std::get<MetallicRoughness>(c.material.surface).roughness;
        const auto most = [&](Vec3 w) { return roughness > 0 ? 1 / ggx_albedo(w.z, roughness).white : 1; };
        ASSERT_LE(f(d[0], d[1]), f(d[1], d[0]) * most(d[0]) * 1.0001) << c.name;
      } else if (const auto* s = std::get_if<Layered>(&c.material.surface)) {
        ASSERT_LE(f(d[0], d[1]), f(d[1], d[0]) * most_of_reverse(*s, d[0], d[1]) * 1.001) << c.name;
      } else {
        const double there = f(d[0], d[1]) * f(d[1], d[2]) * f(d[2], d[0]);
        const double back = f(d[1], d[0]) * f(d[2], d[1]) * f(d[0], d[2]);
        ASSERT_NEAR(there, back, 2e-3 * there) << c.name;
      }
    }
  }
}

TEST(Bsdf, WhatPassesIsReciprocalByTheSquareOfEta) {
  for (const float ior : {0.5F, 0.8F, 1.1F, 1.5F, 3.0F})
    for (const float roughness : {0.3F, 0.6F, 1.0F}) {
      const Material glass{.surface = Dielectric{ior, roughness}};
      const Bsdf outside = make_bsdf(glass.surface, true), inside = make_bsdf(glass.surface, false);
      int seen = 0;
      for (int i = 0; i < 3000; ++i) {
        Random random(i);
        const Vec3 out = at_angle(random.uniform(0.05, 1), random.uniform(0, 6));
        const auto s = draw(outside, out, random);
        if (!s || !s->transmits || s->wi.z > -0.05) continue;
        const Vec3 in{s->wi.x, s->wi.y, -s->wi.z}, back{out.x, out.y, -out.z};  // in the frame of a viewer inside
        const double there =
            double(evaluate(outside, out, s->wi).f_cos.r) / in.z * dielectric_albedo(out.z, roughness, ior);
        const double here =
            double(evaluate(inside, in, back).f_cos.r) / out.z * dielectric_albedo(in.z, roughness, 1 / ior);
        ASSERT_NEAR(there * ior * ior, here, 5e-3 * here) << ior << ' ' << roughness;
        ++seen;
      }
      EXPECT_GT(seen, 100);
    }
}

TEST(Bsdf, WhateverTheInputWhatComesOutIsFiniteAndNotNegative) {
  for (int i = 0; i < effort(200'000, 5'000'000); ++i) {
    Random random(i);
    const Bsdf bsdf = any_bsdf(random);
    const Vec3 wo = any_direction(random, true);
    Vec3 wi = any_direction(random, false);
    if (i % 2 == 0 && wo.z < 1e-3F) wi = {-wo.x, -wo.y, wi.z * wo.z};  // opposite each other in the horizon
    const BsdfValue value = evaluate(bsdf, wo, wi);
    ASSERT_TRUE(is_sound(value.f_cos) && std::isfinite(value.pdf) && value.pdf >= 0) << i;
    ASSERT_TRUE(is_sound(albedo(bsdf, wo)) && albedo(bsdf, wo).r <= 1.001F) << i;
    const auto s = draw(bsdf, wo, random);
    if (!s) continue;
    ASSERT_TRUE(is_finite(s->wi) && std::abs(length(s->wi) - 1) < 1e-4F) << i << ' ' << bsdf.index();
    ASSERT_TRUE(is_sound(s->weight) && std::isfinite(s->pdf) && s->pdf > 0 && s->eta_scale > 0) << i;
    const BsdfValue drawn = evaluate(bsdf, wo, s->wi);
    ASSERT_TRUE(is_sound(drawn.f_cos) && std::isfinite(drawn.pdf)) << i;
  }
}

}  // namespace
}  // namespace tessera
