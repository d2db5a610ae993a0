#include "core/plan/plan.h"

#include <map>

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace tessera {
namespace {

std::map<std::string, std::uint64_t> skips(const Plan& plan) {
  std::map<std::string, std::uint64_t> out;
  for (const Skip& s : plan.skips) out[s.what] = s.count;
  return out;
}

TEST(Plan, BuildsNothingForAHandfulAndATreeForMore) {
  EXPECT_EQ(make_plan(*sparse_scene(), mixed_camera(), {}).accel.kind, AccelKind::brute);
  EXPECT_EQ(make_plan(*mixed_scene(), mixed_camera(), {}).accel.kind, AccelKind::wide);
  Settings asked;
  asked.accel.kind = AccelKind::bvh;
  EXPECT_EQ(make_plan(*sparse_scene(), mixed_camera(), asked).accel.kind, AccelKind::bvh);
}

TEST(Plan, CountsPrimitivesOfEveryInstance) {
  SceneBuilder b;
  const auto mesh = b.shape(icosphere(0));
  b.place(mesh).place(mesh, 0, placed({1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0})).add(Sphere{});
  EXPECT_EQ(make_plan(*b.build(), mixed_camera(), {}).primitives, 41U);
}

TEST(Plan, SaysWhatItSkips) {
  const auto sparse = skips(make_plan(*sparse_scene(), mixed_camera(), {}));
  EXPECT_GT(sparse.at("tiles"), 0U);
  EXPECT_GT(sparse.at("camera_rays"), 512U * 512U * 3 / 4);
  EXPECT_TRUE(sparse.contains("reflection_rays"));
  EXPECT_TRUE(sparse.contains("refraction_rays"));
  EXPECT_FALSE(sparse.contains("shadow_rays"));
  EXPECT_FALSE(sparse.contains("structure"));

  const auto mixed = skips(make_plan(*mixed_scene(), mixed_camera(), {}));
  EXPECT_EQ(mixed.at("objects"), 1U) << "the sphere behind the camera";
  EXPECT_FALSE(mixed.contains("reflection_rays"));
  EXPECT_FALSE(mixed.contains("refraction_rays"));
}

TEST(Plan, SaysThatMeshesMayBeLeftOut) {
  Settings settings;
  settings.accel.kind = AccelKind::wide;
  EXPECT_EQ(skips(make_plan(*mixed_scene(), mixed_camera(), settings)).at("meshes"), 1U);
  const auto alone = SceneBuilder().add(icosphere(2)).build();
  EXPECT_FALSE(skips(make_plan(*alone, mixed_camera(), settings)).contains("meshes")) << "it is built at once";
  settings.accel.kind = AccelKind::bvh;
  EXPECT_FALSE(skips(make_plan(*mixed_scene(), mixed_camera(), settings)).contains("meshes"));
}

TEST(Plan, NeedsNoStructureWhereNothingProjects) {
  const auto behind = SceneBuilder().add(Sphere{{0, 0, 50}, 1}).light(AmbientLight{}).build();
  const Plan plan = make_plan(*behind, mixed_camera(), {});
  EXPECT_FALSE(needs_structure(plan));
  EXPECT_TRUE(skips(plan).contains("structure"));
  EXPECT_TRUE(skips(plan).contains("shadow_rays"));
  Settings off;
  off.screen_bounds = ScreenBounds::off;
  EXPECT_TRUE(needs_structure(make_plan(*behind, mixed_camera(), off)));
}

TEST(Plan, NeedsLightsOnlyWhereAnyMayBeSeen) {
  const auto plan_of = [](IntegratorKind integrator, Vec3 at, Rgb background, const std::optional<Light>& light) {
    SceneBuilder b;
    b.add(Sphere{at, 1}).background(background);
    if (light) b.light(*light);
    Settings settings;
    settings.integrator = integrator;
    return make_plan(*b.build(), mixed_camera(), settings);
  };
  const Vec3 seen{0, 0, 0}, behind{0, 0, 50};
  const Light lamp = PointLight{{0, 5, 0}, {1, 1, 1}}, sun = SunLight{.irradiance = {1, 1, 1}};
  for (const auto path : {IntegratorKind::path, IntegratorKind::direct}) {
    EXPECT_TRUE(needs_lights(plan_of(path, seen, {}, lamp)));
    EXPECT_TRUE(needs_lights(plan_of(path, seen, {1, 1, 1}, {})));
    EXPECT_FALSE(needs_lights(plan_of(path, seen, {}, {}))) << "there is none";
    EXPECT_FALSE(needs_lights(plan_of(path, behind, {1, 1, 1}, lamp))) << "all is one background";
    EXPECT_TRUE(needs_lights(plan_of(path, behind, {}, sun))) << "the background has a sun in it";
  }
  EXPECT_FALSE(needs_lights(plan_of(IntegratorKind::whitted, seen, {}, lamp)));
  EXPECT_FALSE(needs_lights(plan_of(IntegratorKind::ambient_occlusion, seen, {1, 1, 1}, {})));
}

/// What features say of lights and surfaces is what the tracer does with them.
TEST(Plan, FeaturesAreThoseThatTheTracerSees) {
  const auto features = [](const Material& material, const Shape& shape = Sphere{}) {
    SceneBuilder b;
    b.material(material);
    return features_of(*b.add(shape).build());
  };
  const Conductor metal{{0.2F, 0.9F, 1.1F}, {3.9F, 2.4F, 2.2F}, 0.005F};
  EXPECT_FALSE(features({metal}).rough_surfaces) << "all but smooth is smooth";
  EXPECT_FALSE(features({MetallicRoughness{{1, 1, 1}, 1, 0}}).rough_surfaces);
  EXPECT_TRUE(features({MetallicRoughness{{1, 1, 1}, 1, 0.5F}}).rough_surfaces);
  EXPECT_FALSE(features({Dielectric{1.0001F, 0.5F}}).rough_surfaces) << "nothing to be rough";
  EXPECT_FALSE(features({Dielectric{1.5F, 0}}).transmission) << "light is only passed straight";
  EXPECT_TRUE(features({Dielectric{1.5F, 0.5F}}).transmission);
  const Material lamp{.emission = {1, 1, 1}};
  EXPECT_EQ(features(lamp).lights, 1U);
  EXPECT_EQ(features(lamp, Cylinder{{0, 0, 0}, {0, 0, 1}, 1}).lights, 0U) << "it is met by chance alone";
  EXPECT_TRUE(features(lamp, Cylinder{{0, 0, 0}, {0, 0, 1}, 1}).emitters);
  const Features unlit = features({Unlit{}});
  EXPECT_TRUE(unlit.unlit);
  EXPECT_FALSE(unlit.only_whitted);
  EXPECT_EQ(unlit.lights, 0U) << "it is no lamp";
  EXPECT_FALSE(unlit.emitters);
  const Rgb ink{1, 2, 3};
  EXPECT_TRUE(features({.surface = Dielectric{}, .absorption = ink}).absorption);
  EXPECT_FALSE(features({.surface = Dielectric{}, .absorption = ink}).only_whitted) << "he knows of no such thing";
  EXPECT_FALSE(features({.surface = Dielectric{}}).absorption);
  EXPECT_FALSE(features({.surface = Diffuse{}, .absorption = ink}).absorption) << "nothing gets in";
  EXPECT_FALSE(features({.surface = Layered{.metallic = 0, .transmission = 1}, .absorption = ink}).absorption);
  EXPECT_TRUE(
      features({.surface = Layered{.metallic = 0, .transmission = 1, .thin = false}, .absorption = ink}).absorption);
}

}  // namespace
}  // namespace tessera
