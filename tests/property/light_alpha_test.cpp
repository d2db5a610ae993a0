// STRESS 80: surfaces that aren't all there.
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/accel_choices.h"
#include "tests/support/effort.h"
#include "tests/support/light_images.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

/// How layers lie: apart, as near as floats let them, on each other, all together; as quads, as meshes of other
/// triangles, as instances.
struct Layers {
  std::string name;
  void (*add)(SceneBuilder&, int count, std::uint32_t material);
};

float nearly(float z, int steps) {
  for (int i = 0; i < steps; ++i) z = std::nextafter(z, kInfinity);
  return z;
}

const Layers kLayers[] = {
    {"apart",
     [](SceneBuilder& b, int n, std::uint32_t m) {
       for (int i = 0; i < n; ++i) b.add(horizontal(2, 0.3F + 0.1F * static_cast<float>(i)), m);
     }},
    {"a float apart",
     [](SceneBuilder& b, int n, std::uint32_t m) {
       for (int i = 0; i < n; ++i) b.add(horizontal(2, nearly(0.3F, i)), m);
     }},
    {"coincident quads",
     [](SceneBuilder& b, int n, std::uint32_t m) {
       for (int i = 0; i < n; ++i) b.add(horizontal(2, 0.3F, i % 2), m);
     }},
    {"coincident, of all kinds",
     [](SceneBuilder& b, int n, std::uint32_t m) {
       for (int i = 0; i < n; ++i) {
         const Transform at = placed({2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0.25});
         if (i % 3 == 0) b.add(horizontal(2 + static_cast<float>(i), 0.25F), m);
         if (i % 3 == 1) b.place(b.shape(grid_plane(static_cast<std::uint32_t>(i + 1))), m, at);
         if (i % 3 == 2) b.add(Disk{{0, 0, 0.25F}, UnitVec3::z(), 3}, m);
       }
     }},
    {"coincident spheres",  // each met twice
     [](SceneBuilder& b, int n, std::uint32_t m) {
       for (int i = 0; i < n; i += 2) b.add(Sphere{{0, 0, 0.3F}, 0.25F}, m);
     }},
};

Material veil(float alpha, Rgb emission = {}) {
  return {.surface = Diffuse{{}}, .emission = emission, .emits_both_sides = true, .alpha = alpha};
}

/// Through layers that give nothing back, nothing is left to chance: pixels are exact.
TEST(LightAlpha, BlackLayersLetTheirShareOfTheSkyPass_Stress80) {
  for (const AccelEntry& entry : accel_table())
    for (const Layers& layers : kLayers)
      for (const int n : {1, 2, 6})
        for (const float alpha : {0.0F, 0.1F, 0.5F, 0.9F, 1.0F}) {
          if (n == 1 && layers.name == "coincident spheres") continue;
          SceneBuilder b;
          b.background({1, 1, 1});
          layers.add(b, n, b.material(veil(alpha)));
          Settings settings = light_settings(IntegratorKind::path, 5, 4);
          settings.accel.kind = entry.kind;
          settings.aovs = {Aov::alpha};
          const Image image = render_image(b.build(), down_at(0.03F, 0.02F, 2, 0.2F), settings);
          const double due = std::pow(1 - double{alpha}, n);
          const std::string what = layers.name + ", " + std::string(entry.name) + ", " + std::to_string(n) +
                                   " layers of " + std::to_string(alpha);
          ASSERT_NEAR(extremes_of(image.pixels).least, due, 1e-6) << what;
          ASSERT_NEAR(extremes_of(image.pixels).most, due, 1e-6) << what;
          for (const float covered : image.pixels.plane<float>(Aov::alpha)) ASSERT_NEAR(covered, 1 - due, 1e-6) << what;
        }
}

TEST(LightAlpha, LayersLetTheirShareOfALightPass_Stress80) {
  const Light lights[] = {PointLight{{0.1F, -0.1F, 2}, {4, 4, 4}}, DirectionalLight{-UnitVec3::z(), {1, 1, 1}},
                          SpotLight{{0, 0, 2}, -UnitVec3::z(), {4, 4, 4}, 0.5F, 0.6F}};
  for (const AccelKind kind : {AccelKind::brute, AccelKind::bvh, AccelKind::grid, AccelKind::wide})
    for (const Light& light : lights)
      for (const Layers& layers : kLayers)
        for (const int n : {2, 6}) {
          const auto floor = [&](float alpha) {
            SceneBuilder b;
            b.material(Material{.surface = Diffuse{grey(0.5F)}});
            b.add(horizontal(9, 0)).light(light);
            // What they do to light that isn't theirs doesn't matter: shadows are never drawn.
            layers.add(b, n, b.material(Material{.surface = Diffuse{grey(0.8F)}, .alpha = alpha}));
            Settings settings = light_settings(IntegratorKind::direct, 4, 1);
            settings.accel.kind = kind;
            return render_image(b.build(), down_at(0.02F, 0.01F, 0.04F, 0.01F), settings).pixels;
          };
          const Pixels open = floor(0), dimmed = floor(0.3F);
          for (std::size_t i = 0; i < open.color.size(); ++i) {
            ASSERT_GT(open.color[i].g, 0.01F);
            ASSERT_NEAR(dimmed.color[i].g / open.color[i].g, std::pow(1 - double{0.3F}, n), 1e-6)
                << layers.name << ", " << accel_name(kind) << ", " << n;
          }
        }
}

/// What emits, too: layer by layer from the front, each dims what is behind it.
TEST(LightAlpha, LayersThatEmitAddTheirShares_Stress80) {
  SceneBuilder b;
  b.background({8, 8, 8});
  b.add(horizontal(2, 0.4F), b.material(veil(0.25F, {4, 4, 4})))
      .add(horizontal(2, 0.4F), b.material(veil(0.5F, {2, 2, 2})));
  const Extremes seen =
      extremes_of(render_image(b.build(), down_at(0, 0, 1, 0.2F), light_settings(IntegratorKind::path, 5, 4)).pixels);
  const double due = 0.25 * 4 + 0.75 * (0.5 * 2 + 0.5 * 8);
  EXPECT_NEAR(seen.least, due, 1e-5);
  EXPECT_NEAR(seen.most, due, 1e-5);
}

/// Where what is met scatters it has to be drawn: right on the mean.
TEST(LightAlpha, LayersThatScatterAreRightOnTheMean_Stress80) {
  for (const Layers& layers : kLayers) {
    SceneBuilder b;
    b.background({1, 1, 1});
    // In even light a white surface shows what its hole would: a grey one shows the rest.
    layers.add(b, 4, b.material(Material{.surface = Diffuse{{1, 0, 0}}, .alpha = 0.3F}));
    const Moments mean =
        moments_of(render_image(b.build(), down_at(0.03F, 0.02F, 2, 0.2F),
                                light_settings(IntegratorKind::direct, 48, static_cast<std::uint32_t>(effort(16, 512))))
                       .pixels);
    EXPECT_GT(t_test(mean, std::pow(1 - double{0.3F}, 4)), sidak(0.01, 5)) << layers.name << ": " << mean.mean();
  }
}

/// A lamp that is partly there shines as much less, however it is met: seen, sampled, or by chance.
TEST(LightAlpha, EmittersShineByTheirShare_Stress80) {
  for (const int shape : {0, 1, 2}) {
    const auto lit = [&](float alpha, float radiance) {
      SceneBuilder b;
      b.material(Material{.surface = MetallicRoughness{{0.8F, 0.8F, 0.8F}, 0.5F, 0.4F}});
      const auto lamp = b.material(veil(alpha, grey(radiance)));
      b.add(horizontal(9, 0));
      if (shape == 0) b.add(horizontal(0.8F, 1, false), lamp);
      if (shape == 1) b.add(icosphere(1, 0.5F, {0.1F, 0, 1}), lamp);
      if (shape == 2) b.add(Sphere{{0.1F, 0, 1}, 0.5F}, lamp);
      return moments_of(
          render_image(b.build(), OrthographicCamera{{{-1, 0, 0.4F}, {0, 0, 0}, {0, 0, 1}}, 1e-3F},
                       light_settings(IntegratorKind::direct, 32, static_cast<std::uint32_t>(effort(32, 512))))
              .pixels);
    };
    const float alpha = 0.4F;
    // A closed lamp shows its inside through its front.
    const float seen = shape == 0 ? alpha : alpha + (1 - alpha) * alpha;
    EXPECT_GT(welch_test(lit(alpha, 2), lit(1, 2 * seen)), sidak(0.01, 3)) << shape;
  }
}

/// Ambient occlusion sees through them, and they hide their share of the sky.
TEST(LightAlpha, AmbientOcclusionPassesThem_Stress80) {
  const auto seen = [](bool has_floor, float alpha, int layers, float from) {
    SceneBuilder b;
    b.background({8, 8, 8});
    b.material(Material{.surface = Diffuse{grey(0.5F)}});
    const auto veils = b.material(Material{.surface = Diffuse{grey(0.5F)}, .alpha = alpha});
    if (has_floor) b.add(horizontal(1e4F, 0));
    for (int i = 0; i < layers; ++i) b.add(horizontal(1e4F, 0.3F), veils);
    Settings settings =
        light_settings(IntegratorKind::ambient_occlusion, 32, static_cast<std::uint32_t>(effort(16, 256)));
    settings.aovs = {Aov::alpha};
    return render_image(b.build(), down_at(0.02F, 0.01F, from, 0.01F), settings).pixels;
  };
  const double passed = 1 - double{0.4F};
  for (const int layers : {1, 3}) {
    const Extremes beneath = extremes_of(seen(true, 0.4F, layers, 0.1F));
    EXPECT_NEAR(beneath.least, std::pow(passed, layers), 1e-6);
    EXPECT_NEAR(beneath.most, std::pow(passed, layers), 1e-6);
    EXPECT_EQ(extremes_of(seen(true, 0, layers, 1)).least, 1) << "what isn't there at all";
  }
  const Moments above = moments_of(seen(true, 0.4F, 1, 1)), over_nothing = moments_of(seen(false, 0.4F, 1, 1));
  EXPECT_GT(t_test(above, 1 - passed + passed * passed), 1e-3) << above.mean();
  EXPECT_GT(t_test(over_nothing, 1 - passed + passed * 8), 1e-3) << over_nothing.mean();
  const Pixels veil = seen(false, 0.4F, 1, 1);
  Moments covered;
  for (const float part : veil.plane<float>(Aov::alpha)) covered.add(part);
  EXPECT_GT(t_test(covered, 1 - passed), 1e-3) << covered.mean();
}

/// On a transparent background they show nothing but how much of it they hide.
TEST(LightAlpha, TransparentImagesTellWhatLayersHide_Stress80) {
  for (const Layers& layers : kLayers) {
    SceneBuilder b;
    b.background({1, 1, 1});
    layers.add(b, 4, b.material(veil(0.3F)));
    Settings settings = light_settings(IntegratorKind::path, 5, 4);
    settings.aovs = {Aov::alpha};
    settings.transparent = true;
    const Pixels seen = render_image(b.build(), down_at(0.03F, 0.02F, 2, 0.2F), settings).pixels;
    EXPECT_EQ(extremes_of(seen).most, 0) << layers.name;
    for (const float covered : seen.plane<float>(Aov::alpha)) {
      EXPECT_NEAR(covered, 1 - std::pow(1 - double{0.3F}, 4), 1e-6) << layers.name;
    }
  }
}

/// A wall behind a sticker that is partly there, both at one depth: no hole in the wall.
TEST(LightAlpha, WallsBehindStickersStayWhole_Stress80) {
  for (const bool wall_first : {false, true}) {
    SceneBuilder b;
    b.background({100, 100, 100});
    const auto sticker = b.material(veil(0.5F)),
               wall = b.material(Material{.surface = Diffuse{{}}, .emission = {1, 1, 1}});
    if (wall_first) b.add(horizontal(2, 0), wall);
    b.add(horizontal(1, 0), sticker);
    if (!wall_first) b.add(horizontal(2, 0), wall);
    const Extremes seen =
        extremes_of(render_image(b.build(), down_at(0, 0, 1, 0.2F), light_settings(IntegratorKind::path, 9, 4)).pixels);
    EXPECT_EQ(seen.most, wall_first ? 1 : 0.5F);
    EXPECT_EQ(seen.least, seen.most);
  }
}

}  // namespace
}  // namespace tessera
