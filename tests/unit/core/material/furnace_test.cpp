#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "core/material/bsdf.h"
#include "core/material/fresnel.h"
#include "core/sampling/warp.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/statistics.h"
#include "tests/unit/core/material/bsdf_cases.h"

namespace tessera {
namespace {

constexpr double kAngles[] = {1, 0.9, 0.6, 0.3, 0.1, 0.03};
constexpr float kRoughnesses[] = {0, 1e-3F, 0.01F, 0.05F, 0.1F, 0.2F, 0.35F, 0.5F, 0.7F, 0.85F, 1};

/// The mean over a lattice that is spread well in three dimensions (Roberts' generalised golden ratio).
template <class F>
double lattice_mean(int count, const F& f) {
  double sum = 0;
  const auto fraction = [](double x) { return std::min(static_cast<float>(x - std::floor(x)), 0x1.fffffep-1F); };
  for (int i = 0; i < count; ++i)
    sum += f(fraction(0.5 + i * 0.8191725133961645), fraction(0.5 + i * 0.6710436067037893),
             fraction(0.5 + i * 0.5497004779019703));
  return sum / count;
}

/// What comes back of a field of light, by sampling; without the scaling of radiance by 1/eta².
template <class Radiance>
double seen(const Bsdf& bsdf, Vec3 wo, const Radiance& radiance, float Rgb::*channel = &Rgb::g,
            int count = effort(8192, 32'768)) {
  return lattice_mean(count, [&](float u_lobe, float x, float y) {
    const auto s = sample(bsdf, wo, u_lobe, {x, y});
    return s ? double{s->weight.*channel} * s->eta_scale * radiance(s->wi) : 0;
  });
}

double even_light(Vec3) { return 1; }

/// How far from 1 a white surface is, over angles.
struct Furnace {
  double worst = 0, sum = 0;
  int count = 0;

  void add(const Bsdf& bsdf) {
    for (const double cos_theta : kAngles) {
      const double error = std::abs(seen(bsdf, at_angle(cos_theta), even_light) - 1);
      worst = std::max(worst, error);
      sum += error;
      ++count;
    }
  }
  double mean() const { return sum / count; }
};

TEST(Furnace, WhiteMetalGivesBackAll) {
  for (const float roughness : kRoughnesses) {
    Furnace furnace;
    furnace.add(make_bsdf(Conductor{{1, 1, 1}, {1e4F, 1e4F, 1e4F}, roughness}, true));
    EXPECT_LE(furnace.worst, 2.5e-3) << roughness;
  }
}

TEST(Furnace, WhiteGlassGivesBackAllOrLetsItPass) {
  for (const float roughness : kRoughnesses) {
    Furnace usual, any;
    for (const bool entering : {true, false}) {
      for (const float ior : {1.2F, 1.33F, 1.5F, 1.8F, 2.4F})
        usual.add(make_bsdf(Dielectric{ior, roughness}, entering));
      for (const float ior : {1e-3F, 0.1F, 0.5F, 0.9F, 1.0F, 1.02F, 1.1F, 4.0F, 30.0F})
        any.add(make_bsdf(Dielectric{ior, roughness}, entering));
    }
    EXPECT_LE(usual.worst, 1e-2) << roughness;
    EXPECT_LE(usual.mean(), 2e-3) << roughness;
    EXPECT_LE(any.worst, 3e-2) << roughness;
    EXPECT_LE(any.mean(), 4e-3) << roughness;
  }
}

TEST(Furnace, AWhiteCoatedBaseGivesBackAllAtAnyMetallic) {
  for (const float roughness : kRoughnesses)
    for (const float metallic : {0.0F, 0.3F, 1.0F}) {
      Furnace furnace;
      furnace.add(make_bsdf(MetallicRoughness{{1, 1, 1}, metallic, roughness}, true));
      EXPECT_LE(furnace.worst, 5e-3) << roughness << ' ' << metallic;
    }
}

TEST(Furnace, WhiteLayersGiveBackAllOrLetItPass) {
  for (const float roughness : {0.0F, 0.1F, 0.35F, 0.7F, 1.0F})
    for (const float metallic : {0.0F, 0.4F})
      for (const float ior : {1.0F, 1.2F, 1.5F, 2.4F})
        for (const float specular : {0.0F, 0.6F, 1.0F})
          for (const float transmission : {0.0F, 0.3F, 1.0F})
            for (const bool thin : {true, false}) {
              const Layered surface{.metallic = metallic,
                                    .roughness = roughness,
                                    .ior = ior,
                                    .specular = specular,
                                    .transmission = transmission,
                                    .thin = thin,
                                    .clearcoat = 0.8F * roughness,
                                    .clearcoat_roughness = 1 - roughness};
              // Rough glass whose reflection is weighed down isn't given back all that its facets keep.
              const double least = roughness > 0 && specular < 1 && transmission > 0 && !thin ? 0 : 0.985;
              for (const bool entering : {true, false})
                for (const double cos_theta : {1.0, 0.6, 0.1}) {
                  const double got = seen(make_bsdf(surface, entering), at_angle(cos_theta), even_light, &Rgb::g,
                                          effort(2048, 32'768));
                  EXPECT_TRUE(got >= least && got <= 1.015)
                      << got << ": " << roughness << ' ' << metallic << ' ' << ior << ' ' << specular << ' '
                      << transmission << ' ' << thin << ' ' << entering << ' ' << cos_theta;
                }
            }
}

TEST(Furnace, NoMoreComesBackThanCame) {
  for (const BsdfCase& c : bsdf_cases()) {
    if (!c.keeps_energy) continue;
    for (const double cos_theta : kAngles)
      for (float Rgb::*channel : {&Rgb::r, &Rgb::g, &Rgb::b})
        EXPECT_LE(seen(c.bsdf(), at_angle(cos_theta), even_light, channel), 1.01) << c.name << " at " << cos_theta;
  }
}

/// Phong's highlight apart, of which part is below the horizon.
TEST(Furnace, AlbedoIsWhatComesBack) {
  for (const BsdfCase& c : bsdf_cases()) {
    if (std::holds_alternative<Unlit>(c.material.surface)) continue;  // It tells what it shows.
    for (const double cos_theta : {0.9, 0.5})
      EXPECT_NEAR(albedo(c.bsdf(), at_angle(cos_theta)).g,
                  std::min(seen(c.bsdf(), at_angle(cos_theta), even_light), 1.0), c.keeps_energy ? 0.02 : 0.1)
          << c.name;
  }
}

/// Light that isn't even, so that what lands where counts.
double uneven_light(Vec3 w) { return 1 + 0.5 * double{w.x} + 0.7 * double{w.y} * w.y + 0.3 * double{w.z}; }

/// The same by evaluating f in all directions alike, and by sampling.
TEST(Furnace, EvaluatingAndSamplingGiveOneMean) {
  for (const BsdfCase& c : bsdf_cases())
    for (const double cos_theta : {0.9, 0.5, 0.15}) {
      const Bsdf bsdf = c.bsdf();
      const Vec3 wo = at_angle(cos_theta);
      Moments evaluated, sampled;
      Random random(1);
      for (int i = 0; i < effort(20'000, 1'000'000); ++i) {
        const Vec3 wi = uniform_sphere({uniform_float(random), uniform_float(random)});
        evaluated.add(double{evaluate(bsdf, wo, wi).f_cos.g} * uneven_light(wi) / kUniformSpherePdf);
        const auto s = draw(bsdf, wo, random);
        sampled.add(s && !s->is_delta ? double{s->weight.g} * uneven_light(s->wi) : 0);
      }
      EXPECT_GE(welch_test(evaluated, sampled), 1e-5) << c.name << ": " << evaluated.mean() << ' ' << sampled.mean();
    }
}

/// Follows a ray into a sphere until it leaves for good; the light it brings of a field that is 1 everywhere.
double through_sphere(const Material& material, Vec3 wo, Random& random) {
  double throughput = 1;
  bool outside = true;
  for (int depth = 0; depth < 100'000; ++depth) {
    const auto s = draw(make_bsdf(material.surface, outside), wo, random);
    if (!s) return 0;
    throughput *= s->weight.g;
    if (s->transmits) outside = !outside;
    if (outside) return throughput;
    // Inside, seen from where it starts, z is the normal that points inwards (or was passed: then it points up). The
    // chord meets the sphere at the same angle at its other end; which way round doesn't matter.
    const float cos_theta = std::abs(s->wi.z);
    wo = at_angle(std::min(double{cos_theta}, 1.0));
  }
  return 0;
}

TEST(Furnace, Stress58_WhiteGlassAndMirrorsAreInvisible) {
  for (const float ior : {1.0F, 1.33F, 1.5F, 2.4F, 0.75F, 1e-3F})
    for (int i = 0; i < 1000; ++i) {
      Random random(i);
      EXPECT_NEAR(through_sphere({.surface = Dielectric{ior}}, at_angle(random.uniform(0.001, 1)), random), 1, 1e-3)
          << ior;
    }
  const WhittedSurface mirror{.diffuse = {}, .reflect = {1, 1, 1}};
  for (const double cos_theta : kAngles) {
    EXPECT_EQ(seen(make_bsdf(mirror, true), at_angle(cos_theta), even_light), 1);
    EXPECT_NEAR(seen(make_bsdf(Conductor{{1, 1, 1}, {1e4F, 1e4F, 1e4F}}, true), at_angle(cos_theta), even_light), 1,
                1e-3);
  }
}

TEST(Furnace, RoughGlassSpheresAreInvisibleWithinAPercent) {
  for (const float ior : {1.33F, 1.5F, 2.4F})
    for (const float roughness : {0.1F, 0.3F, 0.6F, 1.0F}) {
      Moments light;
      for (int i = 0; i < effort(20'000, 200'000); ++i) {
        Random random(i);
        light.add(through_sphere({.surface = Dielectric{ior, roughness}}, at_angle(std::sqrt(random.uniform(1e-6, 1))),
                                 random));
      }
      EXPECT_NEAR(light.mean(), 1, 0.01 + 4 * light.standard_error()) << ior << ' ' << roughness;
    }
}

/// Of the light behind a pane, what comes straight through: what passes, is reflected an even number of times inside,
/// and passes again, which sums to (1 - F) / (1 + F).
TEST(Furnace, Stress69_AClearPane) {
  for (const float ior : {1.1F, 1.5F, 2.4F}) {
    const Material glass{.surface = Dielectric{ior}};
    const auto part = [&](bool from_outside, bool passes) {
      const auto s =
          sample(make_bsdf(glass.surface, from_outside), {0, 0, 1}, passes ? 0x1.fffffep-1F : 0, {0.5F, 0.5F});
      EXPECT_EQ(s->transmits, passes);
      return double{s->weight.g} * s->pdf;
    };
    const double fresnel = (ior - 1.0) * (ior - 1.0) / ((ior + 1.0) * (ior + 1.0));
    double light = 0, inside = part(true, true);
    for (int depth = 0; depth < 200; ++depth) {
      light += inside * part(false, true);
      inside *= part(false, false) * part(false, false);
    }
    EXPECT_NEAR(light, (1 - fresnel) / (1 + fresnel), 1e-6) << ior;
  }
}

TEST(Furnace, Stress76_RoughTendsToSmooth) {
  const auto surfaces = [](float roughness) {
    return std::vector<Surface>{Conductor{{0.143F, 0.375F, 1.442F}, {3.983F, 2.386F, 1.603F}, roughness},
                                Dielectric{1.5F, roughness},
                                Dielectric{0.7F, roughness},
                                MetallicRoughness{{0.8F, 0.5F, 0.2F}, 1, roughness},
                                MetallicRoughness{{0.8F, 0.5F, 0.2F}, 0.2F, roughness},
                                Layered{.metallic = 0, .roughness = roughness, .transmission = 0.7F},
                                Layered{.metallic = 0, .roughness = roughness, .transmission = 1, .thin = false},
                                Layered{.roughness = 0.5F, .clearcoat = 1, .clearcoat_roughness = roughness}};
  };
  const auto smooth = surfaces(0);
  for (const float roughness : {1e-30F, 1e-3F, 0.0099999F, 0.01F, 0.0101F, 0.03F}) {
    const auto rough = surfaces(roughness);
    for (std::size_t i = 0; i < smooth.size(); ++i)
      for (const double cos_theta : {1.0, 0.7, 0.4, 0.1}) {
        const Vec3 wo = at_angle(cos_theta);
        const double want = seen(make_bsdf(smooth[i], true), wo, uneven_light);
        const double got = seen(make_bsdf(rough[i], true), wo, uneven_light);
        // Either side of the switch, at the roughness where it is.
        const bool is_at_the_switch = roughness >= 0.0099F && roughness < 0.02F;
        EXPECT_NEAR(got, want, (is_at_the_switch ? 0.002 : 0.01) * want)
            << roughness << ", surface " << i << " at " << cos_theta;
      }
  }
}

TEST(Furnace, WithoutADifferenceInIndexLightPassesStraight) {
  for (const float roughness : kRoughnesses)
    for (int i = 0; i < 100; ++i) {
      Random random(i);
      const Vec3 wo = at_angle(random.uniform(1e-6, 1));
      const auto s = draw(make_bsdf(Dielectric{1, roughness}, true), wo, random);
      ASSERT_TRUE(s && s->is_delta && s->transmits);
      EXPECT_EQ(s->wi, -wo);
      EXPECT_EQ(s->weight, Rgb({1, 1, 1}));
    }
}

}  // namespace
}  // namespace tessera
