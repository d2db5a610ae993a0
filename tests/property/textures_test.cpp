// STRESS 79 and 80, textures on surfaces: a square from (-1, -1) to (1, 1), of two triangles, that faces up; its uvs
// have (0, 0) at (-1, 1), the upper left corner as seen from above with y up.
#include "tests/support/textures.h"

#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/light_images.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

TriangleMesh textured_square(float z = 0, std::vector<std::array<float, 4>> colors = {}) {
  TriangleMesh mesh{{{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}}, {{0, 1, 2}, {0, 2, 3}}, {}, {}};
  MeshAttributes attributes;
  attributes.uvs[0] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  attributes.colors = std::move(colors);
  mesh.attributes = std::make_shared<const MeshAttributes>(std::move(attributes));
  return mesh;
}

/// What a camera sees straight down at a point of it, under an even white sky.
Rgb seen(const std::shared_ptr<const Scene>& scene, float x, float y) {
  Settings settings = light_settings(IntegratorKind::path, 2, 1);
  settings.max_depth = 2;
  const Image image = render_image(scene, down_at(x, y), settings);
  return image.pixels.color[0];
}

/// White times 1 under an even sky of 1: so what is seen is the colour, or the albedo.
struct Sheet {
  SceneBuilder builder;
  Material material{.surface = Diffuse{{1, 1, 1}}};

  void use(TextureSlot slot, const Texture& texture, std::uint8_t channel = 0) {
    material.textures.push_back({slot, builder.texture(texture), channel});
  }
  std::shared_ptr<const Scene> lit() {
    return builder.background({1, 1, 1}).add(textured_square(), builder.material(material)).build();
  }
};

Texture nearest(std::shared_ptr<const TextureImage> image) { return {.image = std::move(image), .is_nearest = true}; }

TEST(Textures, StandUprightAndAsWideAsTheirUvs) {
  Sheet sheet;
  sheet.use(TextureSlot::base_color, nearest(grey_image(2, 2, {51, 102, 153, 204})));
  const auto scene = sheet.lit();
  EXPECT_NEAR(seen(scene, -0.5F, 0.5F).g, 0.2, 1e-5);
  EXPECT_NEAR(seen(scene, 0.5F, 0.5F).g, 0.4, 1e-5);
  EXPECT_NEAR(seen(scene, -0.5F, -0.5F).g, 0.6, 1e-5);
  EXPECT_NEAR(seen(scene, 0.5F, -0.5F).g, 0.8, 1e-5);
}

TEST(Textures, MultiplyTheMaterialsOwnColor) {
  Sheet sheet;
  sheet.material.surface = Diffuse{{1, 0.5F, 0.25F}};
  sheet.use(TextureSlot::base_color, nearest(grey_image(1, 1, {102})));
  const Rgb color = seen(sheet.lit(), 0.3F, 0.1F);
  EXPECT_NEAR(color.r, 0.4, 1e-5);
  EXPECT_NEAR(color.g, 0.2, 1e-5);
  EXPECT_NEAR(color.b, 0.1, 1e-5);
}

TEST(Textures, VertexColorsAreMixedOverTheTriangle) {
  SceneBuilder builder;
  const auto material = builder.material(Material{.surface = Diffuse{{1, 1, 1}}, .has_vertex_colors = true});
  builder.background({1, 1, 1}).add(textured_square(0, {{0, 0, 0, 1}, {1, 0, 0, 1}, {1, 0.5F, 0, 1}, {0, 0.5F, 0, 1}}),
                                    material);
  const Rgb color = seen(builder.build(), 0.5F, 0.2F);
  EXPECT_NEAR(color.r, 0.75, 1e-3);
  EXPECT_NEAR(color.g, 0.3, 1e-3);
}

TEST(Textures, EmissionThatVariesIsSeenAndLights) {
  Sheet sheet;
  sheet.material = {.surface = Diffuse{{}}, .emission = {2, 2, 2}};
  sheet.use(TextureSlot::emission, nearest(grey_image(2, 1, {0, 255})));
  const auto scene = sheet.builder.add(textured_square(), sheet.builder.material(sheet.material)).build();
  EXPECT_EQ(seen(scene, -0.5F, 0).g, 0);
  EXPECT_FLOAT_EQ(seen(scene, 0.5F, 0).g, 2);
  EXPECT_FLOAT_EQ(seen(scene, 0.25F, 0.9F).g, 2);
}

/// Irradiance on what lies below a square of 2 m that shines with 2 W/(sr m²) in its right half and is 1 m away, by the
/// form factor of a rectangle (Howell's catalogue, B-4): from beneath one of its corners, a by b at distance 1.
TEST(Textures, EmissionThatVariesLightsWhatItShinesOn) {
  const auto corner = [](double a, double b) {
    return (a / std::sqrt(1 + a * a) * std::atan(b / std::sqrt(1 + a * a)) +
            b / std::sqrt(1 + b * b) * std::atan(a / std::sqrt(1 + b * b))) /
           (2 * std::numbers::pi);
  };
  Sheet sheet;
  sheet.material = {.surface = Diffuse{{}}, .emission = {2, 2, 2}, .emits_both_sides = true};
  sheet.use(TextureSlot::emission, nearest(grey_image(2, 1, {0, 255})));
  const auto white = sheet.builder.material(Material{.surface = Diffuse{{1, 1, 1}}});
  const auto scene = sheet.builder.add(textured_square(0.5F), sheet.builder.material(sheet.material))
                         .add(horizontal(10, -0.5F), white)
                         .build();
  Settings settings = light_settings(IntegratorKind::path, 64, 64, 2);
  const Image image = render_image(scene, down_at(0, 0, 0.2F), settings);
  const Moments moments = moments_of(image.pixels);
  EXPECT_NEAR(moments.mean(), 2 * 2 * corner(1, 1), 5 * moments.standard_error());
}

TEST(Textures, OfAlphaLetTheirSharePass_Stress80) {
  for (const int layers : {1, 2, 7, 40}) {
    Sheet sheet;
    sheet.material = {.surface = Diffuse{{}}, .alpha = 0.5F};
    sheet.use(TextureSlot::alpha, nearest(grey_image(2, 1, {51, 255})));
    const auto material = sheet.builder.material(sheet.material);
    sheet.builder.background({1, 1, 1});
    for (int i = 0; i < layers; ++i)
      sheet.builder.add(textured_square(i % 3 == 2 ? 0 : 0.01F * static_cast<float>(i)), material);
    const auto scene = sheet.builder.build();
    EXPECT_NEAR(seen(scene, -0.5F, 0).g, std::pow(0.9, layers), 1e-6) << layers;
    EXPECT_NEAR(seen(scene, 0.5F, 0).g, std::pow(0.5, layers), 1e-6) << layers;
  }
}

TEST(Textures, OfAlphaLetTheirSharePassToWhatTheyShade_Stress80) {
  for (const int layers : {1, 2, 7}) {
    Sheet sheet;
    sheet.material = {.surface = Diffuse{{}}};
    sheet.use(TextureSlot::alpha, nearest(grey_image(2, 1, {51, 255})));
    const auto veil = sheet.builder.material(sheet.material);
    const auto white = sheet.builder.material(Material{.surface = Diffuse{{1, 1, 1}}});
    for (int i = 0; i < layers; ++i) sheet.builder.add(textured_square(0.5F + 0.01F * static_cast<float>(i)), veil);
    const auto scene =
        sheet.builder.add(horizontal(10, 0), white).light(DirectionalLight{-UnitVec3::z(), {2, 2, 2}}).build();
    Settings settings = light_settings(IntegratorKind::path, 2, 1, 2);
    const auto below = [&](float x) {
      return render_image(scene, down_at(x, 0, 0.2F), settings).pixels.color[0].g * std::numbers::pi / 2;
    };
    EXPECT_NEAR(below(-0.5F), std::pow(0.8, layers), 2e-6) << layers;
    EXPECT_EQ(below(0.5F), 0) << layers;
  }
}

TEST(Textures, CutOffsMakeAllOrNothingOfAlpha) {
  Sheet sheet;
  sheet.material.alpha_cutoff = 0.5F;
  sheet.material.surface = Diffuse{{}};
  sheet.use(TextureSlot::alpha, nearest(grey_image(3, 1, {127, 128, 255})));
  const auto scene = sheet.lit();
  EXPECT_EQ(seen(scene, -0.6F, 0).g, 1);
  EXPECT_EQ(seen(scene, 0, 0).g, 0);
  EXPECT_EQ(seen(scene, 0.6F, 0).g, 0);
}

/// Lit from one direction, a map that says "leaning by 30° to the right, or up" is as bright as a surface that does.
TEST(Textures, NormalsLeanAsTheyAreTold) {
  const auto byte = [](double v) { return static_cast<std::uint8_t>(std::lround((v + 1) / 2 * 255)); };
  const double lean = std::numbers::pi / 6;
  for (const bool has_tangents : {false, true})
    for (const bool to_right : {true, false}) {
      const std::vector<std::uint8_t> texel{byte(to_right ? std::sin(lean) : 0), byte(to_right ? 0 : std::sin(lean)),
                                            byte(std::cos(lean))};
      Sheet sheet;
      sheet.use(TextureSlot::normal, nearest(image_of({1, 1, 3, texel})));
      TriangleMesh mesh = textured_square();
      if (has_tangents) {
        MeshAttributes attributes = *mesh.attributes;
        attributes.tangents.assign(4, {{1, 0, 0}, 1});
        mesh.attributes = std::make_shared<const MeshAttributes>(attributes);
      }
      const Vec3d to_light{to_right ? 0.6 : 0, to_right ? 0 : 0.6, 0.8};
      const auto scene = sheet.builder.add(mesh, sheet.builder.material(sheet.material))
                             .light(DirectionalLight{*UnitVec3::normalize(-1.0 * to_light), {1, 1, 1}})
                             .build();
      const double due = (std::sin(lean) * 0.6 + std::cos(lean) * 0.8) / std::numbers::pi;
      EXPECT_NEAR(seen(scene, 0.2F, 0.3F).g, due, 0.006 * due) << has_tangents << to_right;
    }
}

TEST(Textures, AreDecodedOnlyWhereTheyAreSeen) {
  const auto decoded = std::make_shared<std::atomic<int>>(0), unseen = std::make_shared<std::atomic<int>>(0);
  Sheet sheet;
  sheet.use(TextureSlot::base_color, nearest(image_of({1, 1, 1, std::vector<std::uint8_t>{255}}, decoded)));
  Material other{.surface = Diffuse{{1, 1, 1}}};
  other.textures.push_back({TextureSlot::base_color, sheet.builder.texture(nearest(image_of(
                                                         {1, 1, 1, std::vector<std::uint8_t>{255}}, unseen)))});
  sheet.builder.add(textured_square(-5), sheet.builder.material(other));  // behind the first one
  const auto scene = sheet.lit();
  EXPECT_EQ(*decoded, 0);
  seen(scene, 0, 0);
  EXPECT_EQ(*decoded, 1);
  EXPECT_EQ(*unseen, 0);
}

/// A level disk 1 m above the ground: from beneath its centre it hides sin² of the angle that it reaches to, of what
/// shines evenly on the ground.
TEST(Ground, IsDarkerByTheShareOfTheSkyThatIsHidden) {
  SceneBuilder builder;
  const auto black = builder.material(Material{.surface = Diffuse{{}}});
  builder.add(Disk{{0, 1, 0}, UnitVec3::y(), 1}, black).background({0.5F, 0.5F, 0.5F});
  Scene scene = *builder.build();
  scene.ground = Ground{.height = 0, .darkness = 0.8F};
  Settings settings = light_settings(IntegratorKind::path, 16, 64, 2);
  const OrthographicCamera camera{{{0, 0.5F, 0}, {0, 0, 0}, {0, 0, 1}}, 1e-3F};
  const auto shared = std::make_shared<const Scene>(scene);
  const Moments opaque = moments_of(render_image(shared, camera, settings).pixels);
  EXPECT_NEAR(opaque.mean(), 0.5 * (1 - 0.8 * 0.5), 5 * opaque.standard_error());
  settings.transparent = true;
  settings.aovs = {Aov::alpha};
  const Image through = render_image(shared, camera, settings);
  for (const Rgb& color : through.pixels.color) EXPECT_NEAR(color.g, 0, 1e-6);
  Moments alpha;
  for (const float a : through.pixels.plane<float>(Aov::alpha)) alpha.add(a);
  EXPECT_NEAR(alpha.mean(), 0.8 * 0.5, 5 * alpha.standard_error());
}

}  // namespace
}  // namespace tessera
