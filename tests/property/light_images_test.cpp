// Laws L1, L3, L4 and L6 for light, STRESS 52, 54 and 60: one image, whatever the way, and nothing in it that isn't
// light.
#include "tests/support/light_images.h"

#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/accel/wide/wide_accel.h"
#include "core/render/tile_renderer.h"
#include "tests/support/accel_choices.h"
#include "tests/support/effort.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

std::vector<Surface> all_surfaces() {
  const Rgb eta{0.2F, 0.9F, 1.1F}, k{3.9F, 2.4F, 2.2F};
  return {Diffuse{{0.8F, 0.6F, 0.3F}},
          Conductor{eta, k},
          Conductor{eta, k, 1e-4F},
          Conductor{eta, k, 0.5F},
          Dielectric{1.5F},
          Dielectric{2.4F, 0.03F, {0.5F, 0.9F, 1}},
          Dielectric{1.3F, 1},
          Dielectric{1.5F, 0.3F, {}},
          Dielectric{1},
          MetallicRoughness{{0.9F, 0.6F, 0.3F}, 1, 0.3F},
          MetallicRoughness{{0.9F, 0.6F, 0.3F}, 0, 0},
          MetallicRoughness{{}, 0.5F, 1},
          WhittedSurface{.diffuse = grey(0.4F),
                         .specular = grey(0.4F),
                         .shininess = 1e4F,
                         .reflect = grey(0.2F),
                         .transmit = grey(0.3F),
                         .ior = 1.5F,
                         .fresnel = true},
          WhittedSurface{.diffuse = {}, .reflect = grey(0.9F)}};
}

std::shared_ptr<const EnvironmentMap> small_map() {
  EnvironmentMap map{8, 4, std::vector<Rgb>(32, {0.2F, 0.3F, 0.5F})};
  map.texels[11] = {30, 20, 10};
  map.texels[2] = {};
  return std::make_shared<const EnvironmentMap>(std::move(map));
}

std::vector<Light> all_lights() {
  return {PointLight{{2, 3, 3}, {20, 20, 15}},
          SpotLight{{-2, 3, 2}, *UnitVec3::normalize(Vec3{2, -3, -2}), {30, 20, 20}, 0.2F, 0.4F},
          DirectionalLight{*UnitVec3::normalize(Vec3{1, -2, -1}), {1, 1, 1}},
          SunLight{*UnitVec3::normalize(Vec3{-1, -2, 0.5F}), {2, 2, 1}, 0.05F},
          EnvironmentLight{.map = small_map(), .to_world = {0, 0, 1, 0, 1, 0, -1, 0, 0}}};
}

/// Every shape, material and light: placed, smooth, emitting, not all there, coincident.
std::shared_ptr<const Scene> scene_of_everything() {
  SceneBuilder b;
  std::vector<std::uint32_t> materials;
  for (const Surface& surface : all_surfaces()) materials.push_back(b.material(Material{.surface = surface}));
  const auto lamp = b.material(Material{.surface = Diffuse{grey(0.2F)}, .emission = {4, 3, 2}});
  const auto glow = b.material(
      Material{.surface = Diffuse{grey(0.5F)}, .emission = {0.2F, 0.5F, 1}, .emits_both_sides = true, .alpha = 0.6F});
  const auto veil = b.material(Material{.surface = Diffuse{{}}, .alpha = 0.3F});
  const auto net = b.material(Material{.surface = MetallicRoughness{{0.5F, 0.7F, 0.5F}, 0, 0.4F}, .alpha = 0.5F});
  for (const Light& light : all_lights()) b.light(light);
  b.add(Quad{{{{-4, -1, 4}, {4, -1, 4}, {4, -1, -4}, {-4, -1, -4}}}}, materials[0]);
  const auto smooth = b.shape(smooth_ball(9, 6));
  for (std::uint32_t i = 0; i < materials.size(); ++i) {
    const double x = -2.4 + 0.8 * (i % 7), y = i < 7 ? -0.6 : 0.5, z = i < 7 ? 1 : 0;
    const Vec3 at = to_float(Vec3d{x, y, z});
    if (i % 3 == 0) b.add(Sphere{at, 0.35F}, materials[i]);
    if (i % 3 == 1) b.place(smooth, materials[i], placed({0.35, 0.1, 0, x, 0, -0.3, 0, y, 0.05, 0, 0.4, z}));
    if (i % 3 == 2) b.add(icosphere(1, 0.35F, at), materials[i]);
  }
  b.add(Cone{{2.6F, -1, 0.5F}, 0.5F, {2.6F, 0.4F, 0.5F}, 0.1F}, materials[9]);
  b.add(Cylinder{{-3, -1, -1}, {-2.8F, 1, -1}, 0.3F}, lamp);
  b.add(Disk{{2, 1.4F, -2}, *UnitVec3::normalize(Vec3{-1, -0.2F, 1}), 0.6F}, lamp);
  b.add(Quad{{{{-1, 2, 1}, {-1, 2, 0}, {0, 2, 0}, {0, 2, 1}}}}, lamp);
  b.place(b.shape(icosphere(0, 0.3F)), lamp, placed({1, 0, 0, 1.5, 0, 1, 0.2, 1.5, 0, 0, -0.6, 0.5}));
  b.place(b.shape(Sphere{{0, 0, 0}, 0.4F}), lamp, placed({1, 0.3, 0, -1.7, 0, 0.5, 0, 1.6, 0, 0, 1.2, -0.5}));
  b.add(Sphere{{0.4F, 1.2F, 0.3F}, 0.25F}, glow);
  for (int i = 0; i < 3; ++i)
    b.add(Quad{{{{-1, -0.9F, 1.7F}, {1, -0.9F, 1.7F}, {1, 0.1F, 1.7F}, {-1, 0.1F, 1.7F}}}}, i == 1 ? net : veil);
  b.add(Quad{{{{1.2F, -1, 9}, {1.2F, 1, 9}, {1.2F, 1, 1.2F}, {1.2F, -1, 1.2F}}}}, net);  // beside and behind the camera
  return b.build();
}

const IntegratorKind kIntegrators[] = {IntegratorKind::path, IntegratorKind::direct, IntegratorKind::ambient_occlusion};

Settings everything_settings(IntegratorKind integrator, std::uint32_t width, std::uint32_t height) {
  Settings settings = light_settings(integrator, width, 2);
  settings.height = height;
  settings.aovs = {Aov::depth, Aov::normal, Aov::object_id, Aov::albedo, Aov::position, Aov::alpha};
  return settings;
}

Image reference_image(const std::shared_ptr<const Scene>& scene, const Camera& camera, Settings settings) {
  settings.accel.kind = AccelKind::brute;
  settings.screen_bounds = ScreenBounds::off;
  settings.tile_size = 512;
  return render_image(scene, camera, settings);
}

TEST(LightImages, AreTheSameWhateverTilesAndThreads_Stress52) {
  const auto scene = scene_of_everything();
  for (const IntegratorKind integrator : kIntegrators)
    for (const Camera& camera : {mixed_camera(), orthographic_camera()}) {
      Settings settings = everything_settings(integrator, 33, 20);
      const Image reference = reference_image(scene, camera, settings);
      int threads = 0;
      for (const std::uint32_t size : {1U, 7U, 16U, 64U, kAdaptiveTiles})
        for (const ScreenBounds bounds : {ScreenBounds::off, ScreenBounds::flat, ScreenBounds::hierarchical}) {
          settings.tile_size = size;
          settings.screen_bounds = bounds;
          threads = threads % 3 + 1;
          ASSERT_TRUE(same_bytes(reference.pixels, render_image(scene, camera, settings, threads).pixels))
              << "integrator " << static_cast<int>(integrator) << ", tiles of " << size << ", screen bounds "
              << static_cast<int>(bounds) << ", " << threads << " threads";
        }
    }
}

TEST(LightImages, AreTheSameInEveryStructureAndBound_Stress54) {
  const auto scene = scene_of_everything();
  const auto side = static_cast<std::uint32_t>(effort(12, 100));
  for (const IntegratorKind integrator : kIntegrators) {
    Settings settings = everything_settings(integrator, side * 3 / 2, side);
    const Image reference = reference_image(scene, mixed_camera(), settings);
    int turn = 0;
    for (const AccelOptions& options : accel_choices()) {
      settings.accel = options;
      settings.screen_bounds = static_cast<ScreenBounds>(++turn % 3);
      ASSERT_TRUE(same_bytes(reference.pixels, render_image(scene, mixed_camera(), settings, 1 + turn % 3).pixels))
          << "integrator " << static_cast<int>(integrator) << ", " << describe(options);
    }
    settings.accel = {AccelKind::wide};
    const Plan plan = make_plan(*scene, mixed_camera(), settings);
    for (const WideKernels* kernels : runnable_wide_kernels()) {
      const std::shared_ptr<const Accel> accel = make_wide(scene, settings.accel, *kernels, WideAccel::build_tree);
      ASSERT_TRUE(same_bytes(reference.pixels, render_image(scene, accel, plan, mixed_camera(), settings).pixels))
          << kernels->name;
    }
  }
}

PassWork whole_pass(const RenderContext& context, std::size_t tile) {
  const Settings& settings = context.settings;
  return {std::make_shared<const Pass>(settings.width, settings.height, SampleRange{0, settings.samples}),
          context.plan.tiling.tiles[tile].rect, settings};
}

/// How many samples go together is a matter of time, and where their work is interrupted is, too.
TEST(LightImages, AreTheSameWhateverTheChunks_Stress52) {
  const auto scene = scene_of_everything();
  for (const IntegratorKind integrator : kIntegrators) {
    Settings settings = everything_settings(integrator, 24, 16);
    const Image reference = reference_image(scene, mixed_camera(), settings);
    settings.tile_size = 64;
    const Plan plan = make_plan(*scene, mixed_camera(), settings);
    const std::shared_ptr<const Accel> accel = make_accel(scene, plan.accel);
    for (const std::size_t chunk : {1UL, 2UL, 3UL, 31UL, 64UL, 1000UL, 8192UL}) {
      const RenderContext context{scene, accel, settings, plan, CameraRays(mixed_camera(), 24, 16)};
      *context.chunk = chunk;
      TileRenderer whole(context, 0, whole_pass(context, 0));
      ASSERT_TRUE(whole.go_on([] { return false; }) && whole.finish());
      EXPECT_TRUE(same_bytes(reference.pixels, whole.result().pixels)) << chunk;
      *context.chunk = chunk;
      TileRenderer by_steps(context, 0, whole_pass(context, 0));
      while (!by_steps.go_on([] { return true; })) continue;
      ASSERT_TRUE(by_steps.finish());
      EXPECT_TRUE(same_bytes(reference.pixels, by_steps.result().pixels)) << chunk << ", in steps";
    }
  }
}

/// A plan that skips nothing: every feature is there.
Features all_features(Features features) {
  features.shadows = features.reflection = features.refraction = true;
  features.emitters = features.sky = features.rough_surfaces = true;
  features.transmission = features.alpha = true;
  features.even_sky = false;
  return features;
}

TEST(LightImages, AreTheSameWithoutSkips_L6) {
  std::vector<std::pair<std::string, std::shared_ptr<const Scene>>> scenes{
      {"everything", scene_of_everything()},
      {"mixed", mixed_scene()},
      {"sparse", sparse_scene()},
      {"empty", SceneBuilder().background({1, 2, 3}).build()}};
  const auto ball_in = [](const Material& material, const std::optional<Light>& light, Rgb background) {
    SceneBuilder b;
    b.material(material);
    b.background(background).add(Sphere{{0, 0, 0}, 1}).add(horizontal(3, -1));
    if (light) b.light(*light);
    return b.build();
  };
  const Material matt{.surface = Diffuse{grey(0.7F)}}, mirror{.surface = Conductor{grey(0.2F), grey(4)}};
  for (const Light& light : all_lights()) {
    scenes.emplace_back("matt", ball_in(matt, light, {}));
    scenes.emplace_back("mirror", ball_in(mirror, light, {0.1F, 0.2F, 0.3F}));
  }
  scenes.emplace_back("dark", ball_in(matt, std::nullopt, {}));
  scenes.emplace_back("glass", ball_in({.surface = Dielectric{1.5F}}, std::nullopt, {1, 2, 3}));
  scenes.emplace_back("glow", ball_in({.surface = Dielectric{1.5F}, .emission = {1, 1, 1}}, std::nullopt, {}));
  for (const auto& [name, scene] : scenes)
    for (const bool transparent : {false, true})
      for (const IntegratorKind integrator : {IntegratorKind::path, IntegratorKind::direct}) {
        Settings settings = everything_settings(integrator, 24, 24);
        settings.transparent = transparent;
        const Plan plan = make_plan(*scene, mixed_camera(), settings);
        Settings full = settings;
        full.screen_bounds = ScreenBounds::off;
        Plan skipless = make_plan(*scene, mixed_camera(), full);
        skipless.features = all_features(plan.features);
        const std::shared_ptr<const Accel> accel = make_accel(scene, plan.accel);
        ASSERT_TRUE(same_bytes(render_image(scene, accel, plan, mixed_camera(), settings).pixels,
                               render_image(scene, accel, skipless, mixed_camera(), full).pixels))
            << name << ", integrator " << static_cast<int>(integrator);
      }
}

/// Every material in every light, seen by every camera: light is a number, and never less than none.
TEST(LightImages, HoldNoNanInfinityOrNegative_Stress60) {
  const Camera cameras[] = {
      mixed_camera(), orthographic_camera(),
      PerspectiveCamera{{{0.1F, 0.1F, 0.2F}, {0, 0, 5}, {0, 1, 0}}, 1.2F},      // from inside a ball
      PerspectiveCamera{{{0, -0.999F, 3}, {0, -0.999F, 0}, {0, 1, 0}}, 0.5F}};  // along the ground
  std::vector<std::vector<Light>> lights{all_lights(), {}};
  for (const Light& light : all_lights()) lights.push_back({light});
  lights.push_back({PointLight{{0, 0, 0.2F}, {1e12F, 1e-12F, 1}}});  // inside
  lights.push_back({PointLight{{0.5F, -1, 1.5F}, {1, 1, 1}}});       // on a surface
  lights.push_back(
      {SunLight{-UnitVec3::y(), {1e6F, 1, 0}, 3.1415F}, EnvironmentLight{.radiance = grey(1e-30F), .map = nullptr}});
  lights.push_back({SunLight{-UnitVec3::y(), {1, 1, 1}, 1e-6F}});
  lights.push_back({SpotLight{{0, 3, 0}, -UnitVec3::y(), {1e6F, 1, 0}, 0, 1e-4F}});
  for (const Surface& surface : all_surfaces())
    for (const bool emits : {false, true}) {
      for (const std::vector<Light>& lit : lights) {
        SceneBuilder b;
        b.material(Material{.surface = surface,
                            .emission = grey(emits ? 0.5F : 0),
                            .emits_both_sides = emits,
                            .alpha = emits ? 0.7F : 1});
        for (const Light& light : lit) b.light(light);
        b.background({0.1F, 0.2F, 0.3F})
            .add(Sphere{{0, 0, 0}, 1})
            .add(Quad{{{{-4, -1, 4}, {4, -1, 4}, {4, -1, -4}, {-4, -1, -4}}}});
        b.place(b.shape(smooth_ball(8, 5)), 0, placed({0.6, 0, 0, 1.6, 0, -0.6, 0, -0.4, 0.2, 0, 0.3, 0.8}));
        b.add(Cone{{-1.6F, -1, 0.5F}, 0.5F, {-1.6F, 0.4F, 0.5F}, 0})
            .add(Cylinder{{0, -1, 1.5F}, {0, 0.4F, 1.5F}, 0.1F});
        b.add(Disk{{0, -1, 1}, UnitVec3::y(), 1});
        const auto scene = b.build();
        for (const Camera& camera : cameras) {
          const auto side = static_cast<std::uint32_t>(effort(8, 64));
          Settings settings = light_settings(IntegratorKind::path, side, static_cast<std::uint32_t>(effort(1, 64)));
          settings.aovs = {Aov::albedo, Aov::alpha};
          const Pixels seen = render_image(scene, camera, settings).pixels;
          const Extremes found = extremes_of(seen);
          ASSERT_TRUE(found.all_finite && found.least >= 0)
              << "surface " << surface.index() << (emits ? ", emitting" : "");
          for (const Rgb& c : seen.plane<Rgb>(Aov::albedo)) ASSERT_TRUE(c.r >= 0 && c.r <= 1.001F);
          for (const float covered : seen.plane<float>(Aov::alpha)) ASSERT_TRUE(covered >= 0 && covered <= 1);
        }
      }
    }
}

/// FNV-1a over the bits of an image's colours.
std::uint64_t hash_of(const Pixels& pixels) {
  std::uint64_t hash = 0xCBF29CE484222325ULL;
  for (const Rgb& c : pixels.color)
    for (const float v : {c.r, c.g, c.b})
      for (std::uint32_t bits = std::bit_cast<std::uint32_t>(v), i = 0; i < 4; ++i, bits >>= 8)
        hash = (hash ^ (bits & 0xFF)) * 0x100000001B3ULL;
  return hash;
}

/// As before there was anything else than Whitted's tracer: the hashes are of commit 0e87d9f, built apart, by brute
/// force, without optimisations of today.
TEST(LightImages, WhittedsAreWhatTheyWere) {
  struct Known {
    Camera camera;
    std::uint32_t samples;
    std::uint64_t hash;
  };
  for (const auto& [camera, samples, hash] : {Known{mixed_camera(), 1, 0x7A7EAB003115B3FDULL},
                                              {mixed_camera(), 6, 0x959B375A2CB47F69ULL},
                                              {orthographic_camera(), 1, 0x7A8617A7A73ED377ULL},
                                              {orthographic_camera(), 6, 0xABC4EF9F77DADDABULL}}) {
    Settings settings;
    settings.width = 66;
    settings.height = 35;
    settings.samples = samples;
    settings.seed = 9;
    EXPECT_EQ(hash_of(render_image(mixed_scene(), camera, settings).pixels), hash) << samples;
  }
}

}  // namespace
}  // namespace tessera
