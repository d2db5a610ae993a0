// STRESS 55, 56, 58 and 69: light that has nowhere to go, rendered.
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/light_images.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr SamplerKind kSamplers[] = {SamplerKind::independent, SamplerKind::sobol};
const Camera kFromInside = PerspectiveCamera{{{0.1F, 0.2F, -0.3F}, {1, 0.4F, 0.3F}, {0, 1, 0}}, 1.4F};

/// Closed rooms around the origin whose walls emit 1 and give back `albedo`.
std::vector<std::pair<std::string, std::shared_ptr<const Scene>>> rooms(float albedo) {
  const Material wall{.surface = Diffuse{grey(albedo)}, .emission = {1, 1, 1}, .emits_both_sides = true};
  std::vector<std::pair<std::string, std::shared_ptr<const Scene>>> rooms;
  const auto add = [&](const char* name, auto&& fill) {
    SceneBuilder b;
    b.material(wall);
    fill(b);
    rooms.emplace_back(name, b.build());
  };
  add("sphere", [](SceneBuilder& b) { b.add(Sphere{{0, 0, 0}, 1}); });
  add("ellipsoid", [](SceneBuilder& b) {
    b.place(b.shape(Sphere{{0, 0, 0}, 1}), 0, placed({1.5, 0.2, 0, 0, 0, 1, 0, 0.1, 0, 0, 2, 0}));
  });
  add("quads", [](SceneBuilder& b) {
    for (const bool low : {true, false}) {
      const float s = low ? -1 : 1;
      b.add(Quad{{{{s, -1, -1}, {s, 1, -1}, {s, 1, 1}, {s, -1, 1}}}});
      b.add(Quad{{{{-1, s, -1}, {1, s, -1}, {1, s, 1}, {-1, s, 1}}}});
      b.add(Quad{{{{-1, -1, s}, {1, -1, s}, {1, 1, s}, {-1, 1, s}}}});
    }
  });
  add("triangles", [](SceneBuilder& b) { b.add(icosphere(1)); });
  add("tin", [](SceneBuilder& b) {  // whose side no light is sampled from
    b.add(Cylinder{{0, 0, -1}, {0, 0, 1}, 1});
    b.add(Disk{{0, 0, 1}, -UnitVec3::z(), 1}).add(Disk{{0, 0, -1}, UnitVec3::z(), 1});
  });
  add("room in a room", [](SceneBuilder& b) {  // light comes from what faces it, whatever is behind
    b.add(Sphere{{0, 0, 0}, 1.5F}).add(Sphere{{0.6F, 0.3F, 0.2F}, 0.3F}).add(icosphere(0, 0.2F, {-0.5F, 0.2F, 0.4F}));
  });
  return rooms;
}

TEST(LightFurnaces, RoomsThatEmitAreAsBrightAsTheyReflect_Stress55) {
  struct Case {
    float albedo;
    std::uint32_t side, samples, depth;
  };
  const double level = sidak(0.01, 3 * 2 * 6);
  for (const auto& [albedo, side, samples, depth] : {Case{0.5F, 24, 16, 64}, {0.8F, 16, 16, 200}, {0.99F, 10, 4, 4000}})
    for (const auto& [name, scene] : rooms(albedo))
      for (const SamplerKind sampler : kSamplers) {
        Settings settings =
            light_settings(IntegratorKind::path, side, samples * static_cast<std::uint32_t>(effort(1, 16)), depth);
        settings.sampler = sampler;
        const Pixels seen = render_image(scene, kFromInside, settings).pixels;
        const Moments mean = moments_of(seen);
        const double due = 1 / (1 - double{albedo});
        EXPECT_GT(t_test(mean, due), level)
            << name << ", albedo " << albedo << ", sampler " << static_cast<int>(sampler) << ": " << mean.mean()
            << " ± " << mean.standard_error();
        // What few paths of random lengths bring is spread about like a gamma distribution: its tail isn't short.
        EXPECT_LT(extremes_of(seen).most, due + 12 * std::sqrt(mean.variance()) + 1e-4)
            << name << ", albedo " << albedo;
      }
}

/// A path of one segment sees what emits; each further one adds what is reflected once more.
TEST(LightFurnaces, DepthCountsSegments_Stress55) {
  for (const float albedo : {0.5F, 0.9F})
    for (const auto& [name, scene] : rooms(albedo))
      for (const std::uint32_t depth : {1U, 2U, 3U, 7U, 12U}) {  // roulette begins after five
        const Settings settings =
            light_settings(IntegratorKind::path, 16, static_cast<std::uint32_t>(effort(8, 512)), depth);
        const Moments mean = moments_of(render_image(scene, kFromInside, settings).pixels);
        const double due = (1 - std::pow(double{albedo}, depth)) / (1 - double{albedo});
        EXPECT_TRUE(std::abs(mean.mean() / due - 1) < 1e-6 || t_test(mean, due) > sidak(0.01, 2 * 6 * 5))
            << name << ", depth " << depth << ": " << mean.mean() << " ± " << mean.standard_error() << ", due " << due;
      }
}

/// In a room of one brightness whatever gives off as much as it takes can't be seen, nor what it does to the rest.
TEST(LightFurnaces, RoomsInEquilibriumHideWhatIsInThem_Stress55_Stress58) {
  const auto emits = [](const Surface& surface, float emission, float alpha = 1) {
    return Material{.surface = surface, .emission = grey(emission), .emits_both_sides = true, .alpha = alpha};
  };
  const std::pair<const char*, Material> materials[] = {
      {"grey lamp", emits(Diffuse{grey(0.2F)}, 1.6F)},
      {"grey lamp, half there", emits(Diffuse{grey(0.2F)}, 1.6F, 0.5F)},
      {"black lamp, a third there", emits(Diffuse{{}}, 2, 0.3F)},
      {"white, half there", emits(Diffuse{grey(1)}, 0, 0.5F)},
      {"glass", emits(Dielectric{1.5F}, 0)},
      {"rough glass", emits(Dielectric{1.5F, 0.5F}, 0)},
      {"rough glass, half there", emits(Dielectric{1.5F, 0.5F}, 0, 0.5F)},
      {"rough metal", emits(MetallicRoughness{{1, 1, 1}, 1, 0.5F}, 0)},
      {"Whitted's glass", emits(glass_material(), 0)},
      {"half a mirror that emits", emits(WhittedSurface{.diffuse = {}, .reflect = grey(0.5F)}, 1)}};
  const std::pair<const char*, void (*)(SceneBuilder&)> shapes[] = {
      {"ball",
       [](SceneBuilder& b) {
         b.add(Sphere{{0.5F, 0, 0.2F}, 0.4F}, 1);
       }},
      {"egg",
       [](SceneBuilder& b) {
         b.place(b.shape(Sphere{{0, 0, 0}, 1}), 1, placed({0.5, 0.1, 0, 0.4, 0, 0.2, 0, 0, 0, 0.1, -0.4, 0.1}));
       }},
      {"balls in a ball",
       [](SceneBuilder& b) {
         b.add(Sphere{{0.4F, 0, 0.2F}, 0.55F}, 1)
             .add(Sphere{{0.4F, 0.1F, 0.2F}, 0.2F}, 1)
             .add(icosphere(0, 0.15F, {0.3F, 0.1F, 0.5F}), 1);
       }},
      {"mesh",
       [](SceneBuilder& b) {
         b.add(icosphere(1, 0.4F, {0.5F, 0, 0.2F}), 1);
       }},
      {"sheets",
       [](SceneBuilder& b) {
         b.add(Quad{{{{0.2F, -0.5F, 0}, {0.6F, -0.5F, 0.1F}, {0.6F, 0.5F, 0}, {0.2F, 0.5F, 0}}}}, 1);  // and not flat
         b.add(Disk{{0.4F, 0, 0.3F}, *UnitVec3::normalize(Vec3{1, 0, 1}), 0.4F}, 1);
       }},
      {"tin", [](SceneBuilder& b) {
         b.add(Cylinder{{0.5F, -0.3F, 0}, {0.5F, 0.3F, 0}, 0.3F}, 1).add(Disk{{0.5F, 0.3F, 0}, UnitVec3::y(), 0.3F}, 1);
         b.add(Disk{{0.5F, -0.3F, 0}, -UnitVec3::y(), 0.3F}, 1);
       }}};
  for (const auto& [name, material] : materials)
    for (const auto& [shape, add] : shapes) {
      // Light in glass is denser: what has no inside can't be made of it.
      if (std::string_view(shape) == "sheets" && std::string_view(name).find("glass") != std::string_view::npos)
        continue;
      SceneBuilder b;
      b.material(Material{.surface = Diffuse{grey(0.5F)}, .emission = {1, 1, 1}, .emits_both_sides = true});
      b.material(material);
      b.add(Sphere{{0, 0, 0}, 1.2F});
      add(b);
      const Settings settings =
          light_settings(IntegratorKind::path, 20, static_cast<std::uint32_t>(effort(8, 256)), 200);
      const Camera camera = PerspectiveCamera{{{-0.9F, 0.2F, -0.3F}, {0.5F, 0, 0.2F}, {0, 1, 0}}, 1};
      const Moments mean = moments_of(render_image(b.build(), camera, settings).pixels);
      // Tables say what rough glass and metal keep: to some thousandths.
      EXPECT_TRUE(std::abs(mean.mean() - 2) < 1e-3 || t_test(mean, 2) > sidak(0.01, 60))
          << name << ", " << shape << ": " << mean.mean() << " ± " << mean.standard_error();
    }
}

struct Lit {
  std::string name;
  IntegratorKind integrator;
  std::shared_ptr<const Scene> scene;
};

/// Unit spheres whose inside shows 1 all over: by light from their middles, or from themselves.
std::vector<Lit> unit_spheres() {
  const auto lit = [](const Material& material, float intensity) {
    SceneBuilder b;
    b.material(material);
    for (int i = 0; i < 2; ++i)
      if (intensity > 0) b.light(PointLight{{0, 0, 0}, grey(intensity / 2)});
    return b.add(Sphere{{0, 0, 0}, 1}).build();
  };
  const auto emits = [](float color) {
    return Material{.surface = Diffuse{grey(color)}, .emission = grey(0.5F), .emits_both_sides = true};
  };
  const Material half{.surface = Diffuse{grey(0.5F)}}, whitted{.surface = diffuse(grey(0.5F))};
  return {{"path, point lights", IntegratorKind::path, lit(half, kPi)},
          {"path, Whitted's surface", IntegratorKind::path, lit(whitted, kPi)},
          {"path, emission", IntegratorKind::path, lit(emits(0.5F), 0)},
          {"direct, point lights", IntegratorKind::direct, lit(half, 2 * kPi)},
          {"direct, emission", IntegratorKind::direct, lit(emits(1), 0)},
          {"whitted, point lights", IntegratorKind::whitted, lit(whitted, 2 * kPi)}};
}

TEST(LightFurnaces, UnitSpheresShowOne_Stress56) {
  const double level = sidak(0.01, 6 * 3);
  for (const auto& [name, integrator, scene] : unit_spheres())
    for (const SamplerKind sampler : {SamplerKind::grid, SamplerKind::independent, SamplerKind::sobol}) {
      if (sampler == SamplerKind::grid && integrator != IntegratorKind::whitted) continue;
      Settings settings = light_settings(integrator, long_tests() ? 64 : 24, long_tests() ? 256 : 16);
      if (integrator == IntegratorKind::path) settings.max_depth = 64;
      settings.sampler = sampler;
      const Moments mean = moments_of(render_image(scene, kFromInside, settings).pixels);
      EXPECT_NEAR(mean.mean(), 1, long_tests() ? 0.001 : 0.025) << name << ", sampler " << static_cast<int>(sampler);
      // Where nothing is left to chance there is rounding alone.
      EXPECT_TRUE(std::abs(mean.mean() - 1) < 1e-5 || t_test(mean, 1) > level)
          << name << ", sampler " << static_cast<int>(sampler) << ": " << mean.mean() << " ± " << mean.standard_error();
    }
}

/// Of a point inside a sphere the share of a hemisphere that lies within reach is the square of half of that.
TEST(LightFurnaces, AmbientOcclusionSeesAsFarAsItReaches_Stress56) {
  SceneBuilder b;
  b.material(Material{});
  const auto scene = b.add(Sphere{{0, 0, 0}, 1}).build();
  for (const SamplerKind sampler : kSamplers)
    for (const float reach : {0.01F, 0.6F, 1.2F, kInfinity}) {
      Settings settings = light_settings(IntegratorKind::ambient_occlusion, 24, 16);
      settings.sampler = sampler;
      settings.ambient_occlusion_reach = reach;
      const Moments mean = moments_of(render_image(scene, kFromInside, settings).pixels);
      const double due = 1 - std::min(1.0, double{reach} * reach / 4);
      EXPECT_TRUE(std::abs(mean.mean() - due) < 1e-4 || t_test(mean, due) > sidak(0.01, 8))
          << reach << ": " << mean.mean() << " ± " << mean.standard_error();
    }
}

/// All light that comes to a white body leaves it again: in light from all around it can't be seen.
TEST(LightFurnaces, WhiteBodiesVanishInEvenLight_Stress58) {
  std::vector<std::pair<std::string, Material>> white;
  white.emplace_back("Whitted's glass", Material{glass_material()});
  white.emplace_back("Whitted's mirror", Material{WhittedSurface{.diffuse = {}, .reflect = {1, 1, 1}}});
  white.emplace_back("a conductor's mirror", Material{Conductor{grey(1e-6F), grey(1)}});
  white.emplace_back("diffuse", Material{Diffuse{{1, 1, 1}}});
  for (const float roughness : {0.0F, 0.02F, 0.1F, 0.3F, 0.6F, 1.0F}) {
    const std::string suffix = ", roughness " + std::to_string(roughness);
    for (const float ior : {1.1F, 1.5F, 2.4F, 0.7F})
      white.emplace_back("glass, ior " + std::to_string(ior) + suffix, Material{Dielectric{ior, roughness}});
    white.emplace_back("metal" + suffix, Material{MetallicRoughness{{1, 1, 1}, 1, roughness}});
  }
  const double level = sidak(0.01, static_cast<double>(white.size()));
  bool has_map = false;
  for (const auto& [name, material] : white) {
    has_map = !has_map;
    for (const bool is_map : {false, true}) {
      if (!long_tests() && is_map != has_map) continue;
      SceneBuilder b;
      b.material(material);
      if (is_map)
        b.light(EnvironmentLight{
            .map = std::make_shared<EnvironmentMap>(EnvironmentMap{4, 2, std::vector<Rgb>(8, {1, 1, 1})})});
      else
        b.background({1, 1, 1});
      const auto scene = b.add(Sphere{{0, 0, 0}, 1}).build();
      const Camera camera = PerspectiveCamera{{{0, 0, 3}, {0, 0, 0}, {0, 1, 0}}, 0.68F};
      const Settings settings =
          light_settings(IntegratorKind::path, 20, static_cast<std::uint32_t>(effort(32, 1024)), 400);
      const Moments mean = moments_of(render_image(scene, camera, settings).pixels);
      EXPECT_TRUE(std::abs(mean.mean() - 1) < 1e-3 || t_test(mean, 1) > level)
          << name << (is_map ? ", map" : ", constant") << ": " << mean.mean() << " ± " << mean.standard_error();
    }
  }
}

/// A pane passes what a series of reflections inside it leaves: 1 - F, weighed with the tint once for each way through.
TEST(LightFurnaces, PanesPassWhatTheyDontReflect_Stress69) {
  std::vector<std::pair<Material, double>> panes;  // and the tint of a way through a side
  panes.emplace_back(Material{Dielectric{1.5F}}, 1);
  panes.emplace_back(Material{Dielectric{2.4F}}, 1);
  panes.emplace_back(Material{Dielectric{1.5F, 0, grey(0.7F)}}, 0.7);
  panes.emplace_back(Material{glass_material()}, 1);
  for (const auto& [material, tint] : panes)
    for (const IntegratorKind integrator : {IntegratorKind::path, IntegratorKind::whitted}) {
      const auto whitted = whitted_surface(material.surface);
      if (integrator == IntegratorKind::whitted && !std::holds_alternative<WhittedSurface>(material.surface)) continue;
      SceneBuilder b;
      const auto glass = b.material(material);
      const auto lamp = b.material(Material{.surface = Diffuse{{}}, .emission = {2, 2, 2}});
      b.add(horizontal(5, 0, false), glass).add(horizontal(5, 0.1F), glass);
      if (integrator == IntegratorKind::path)
        b.add(horizontal(5, -1), lamp);
      else
        b.background({2, 2, 2});
      const double ior = whitted->ior, f = std::pow((ior - 1) / (ior + 1), 2);
      const double through = std::pow((1 - f) * tint, 2) / (1 - f * f);
      // In a light from everywhere what is reflected at the front is light, too.
      const double back = f + f * through;
      const double due = 2 * (integrator == IntegratorKind::path ? through : through + back);
      const Settings settings = light_settings(integrator, 24, static_cast<std::uint32_t>(effort(32, 1024)), 64);
      const Moments mean = moments_of(render_image(b.build(), down_at(0.3F, 0.2F, 3), settings).pixels);
      EXPECT_TRUE(std::abs(mean.mean() / due - 1) < 1e-5 || t_test(mean, due) > sidak(0.01, 4))
          << "ior " << ior << ", tint " << tint << ": " << mean.mean() << " ± " << mean.standard_error() << ", due "
          << due;
      if (tint == 1) {
        EXPECT_NEAR(through, (1 - f) / (1 + f), 1e-12);
      }
    }
}

}  // namespace
}  // namespace tessera
