#include "core/light/light_table.h"

#include <cmath>
#include <memory>

#include "tests/support/scenes.h"
#include "tests/unit/core/light/light_checks.h"

namespace tessera::light_checks {
namespace {

TEST(LightTable, AnEmptySceneHasNoLight) {
  const auto scene = SceneBuilder().add(Sphere{}).light(AmbientLight{{1, 1, 1}}).build();
  const LightTable table(scene);
  EXPECT_TRUE(table.empty());
  EXPECT_EQ(table.count(), 0U);
  EXPECT_FALSE(table.sample(table.viewpoint({0, 0, 0}, {}), 0.5F, {0.5F, 0.5F}));
  EXPECT_TRUE(table.escaped(table.viewpoint({}, {}), kUp).radiance.is_black());
  EXPECT_EQ(table.escaped(table.viewpoint({}, {}), kUp).pdf, 0);
  EXPECT_EQ(table.pdf_hit(table.viewpoint({0, 0, 3}, {}), -kUp, {0, 0}, 2, {0, 0, 1}), 0);
}

TEST(LightTable, KeepsItsScene) {
  auto scene = SceneBuilder().add(Sphere{}).light(PointLight{{0, 0, 2}, {4, 4, 4}}).build();
  const std::weak_ptr<const Scene> watched = scene;
  const LightTable table(std::move(scene));
  EXPECT_FALSE(watched.expired());
  EXPECT_TRUE(table.sample(table.viewpoint({0, 0, 0}, kUp), 0.5F, {0.5F, 0.5F}));
}

TEST(LightTable, TheEnvironmentThatCountsIsTheScenes) {
  SceneBuilder b;
  const auto sky = [](Rgb radiance) {
    EnvironmentLight light;
    light.radiance = radiance;
    return light;
  };
  b.background({9, 9, 9}).light(sky({1, 2, 3})).light(sky({4, 5, 6}));
  const auto scene = b.build();
  EXPECT_EQ(LightTable(scene).escaped(LightTable(scene).viewpoint({}, {}), kUp).radiance,
            environment_of(*scene).radiance);
}

TEST(LightTable, PointLightsFallOff) {
  const auto scene = SceneBuilder()
                         .light(PointLight{{0, 0, 2}, {4, 8, 12}})
                         .light(PointLight{{0, 0, 1}, {1, 1, 1}, false})  // Whitted's alone
                         .build();
  const LightTable table(scene);
  EXPECT_EQ(table.count(), 1U);
  const auto sample = table.sample(table.viewpoint({0, 0, 0}, kUp), 0.25F, {0, 0});
  ASSERT_TRUE(sample);
  EXPECT_TRUE(sample->is_delta);
  EXPECT_EQ(sample->to_light, kUp);
  EXPECT_EQ(sample->distance, 2);
  EXPECT_EQ(sample->radiance, (Rgb{1, 2, 3}));
  EXPECT_EQ(sample->pdf, 1);
  const Ray ray = table.shadow_ray(*sample, {0, 0, 0});
  EXPECT_LT(ray.t_max, 1);
  EXPECT_FALSE(table.sample(table.viewpoint({0, 0, 2}, {}), 0.25F, {0, 0})) << "where the light is";
}

TEST(LightTable, Stress73_ASpotsPowerIsTheClosedForm) {
  // ∫ smoothstep over the solid angle: 2π (1 − (cos inner + cos outer) / 2), as smoothstep's mean is 1/2.
  Random random(73);
  for (const auto& [inner, outer] : {std::array{0.2F, 0.6F}, {0.0F, 1.5F}, {0.7F, 0.7F}, {0.0F, 0.01F}}) {
    SpotLight spot;
    spot.position = {1, 2, 3};
    spot.direction = *UnitVec3::normalize(Vec3{1, -2, 2});
    spot.intensity = {1, 3, 1};
    spot.inner_angle = inner;
    spot.outer_angle = outer;
    const auto scene = SceneBuilder().light(spot).build();
    const LightTable table(scene);
    // Over a cone a little wider than the light's, by points on a sphere of radius 2 around it.
    const auto one_minus_cos = static_cast<float>(2 * std::pow(std::sin(0.55 * outer), 2));
    const Basis basis = basis_around(spot.direction);
    Moments power;
    for (int i = 0; i < 200'000; ++i) {
      const Vec3d way = to_double(basis.to_world(uniform_cone(random_square(random), one_minus_cos)));
      const auto sample = table.sample(table.viewpoint(to_double(spot.position) + way * 2, {}), 0.5F, {});
      power.add(sample ? sample->radiance.g * 4 * 2 * kPi * one_minus_cos : 0);
    }
    const double right = 3 * kPi * (2 - std::cos(double{inner}) - std::cos(double{outer}));
    expect_mean(power, right);
  }
}

TEST(LightTable, Stress73_ASpotsEdgesAreWhereTheyAreSaidToBe) {
  SpotLight spot;
  spot.direction = UnitVec3::x();
  spot.intensity = {2, 2, 2};
  spot.inner_angle = 0.3F;
  spot.outer_angle = 0.5F;
  const auto scene = SceneBuilder().light(spot).build();
  const LightTable table(scene);
  const auto at = [&](double angle) {
    const auto sample = table.sample(table.viewpoint({std::cos(angle), std::sin(angle), 0}, {}), 0.5F, {});
    return sample ? sample->radiance.g : 0;
  };
  EXPECT_FLOAT_EQ(at(0), 2);
  EXPECT_FLOAT_EQ(at(0.2999), 2);
  EXPECT_LT(at(0.3101), 2);
  EXPECT_GT(at(0.4999), 0);
  EXPECT_EQ(at(0.5001), 0);
  EXPECT_EQ(at(3), 0);
  EXPECT_NEAR(at(std::acos((std::cos(0.3) + std::cos(0.5)) / 2)), 1, 1e-5);
}

TEST(LightTable, DirectionalLightsAreInfinitelyFarAway) {
  const auto scene = SceneBuilder().light(DirectionalLight{*UnitVec3::normalize(Vec3{0, 3, -4}), {1, 2, 3}}).build();
  const LightTable table(scene);
  const auto sample = table.sample(table.viewpoint({5, 6, 7}, kUp), 0.9F, {0, 0});
  ASSERT_TRUE(sample);
  EXPECT_TRUE(sample->is_delta);
  EXPECT_EQ(sample->pdf, 1);
  EXPECT_EQ(sample->distance, kInfinity);
  EXPECT_EQ(sample->radiance, (Rgb{1, 2, 3}));
  EXPECT_NEAR(sample->to_light.z, 0.8, 1e-6);
  EXPECT_EQ(table.shadow_ray(*sample, {5, 6, 7}).t_max, kInfinity);
  EXPECT_EQ(table.escaped(table.viewpoint({}, {}), sample->to_light).pdf, 0) << "no ray meets it by chance";
}

TEST(LightTable, Stress74_ASunIsADiskOfItsAngleAndIrradiance) {
  for (const float angle : {3.0F, 0.5F, 0.00925F, 1e-4F}) {
    SCOPED_TRACE(angle);
    SunLight sun;
    sun.direction = *UnitVec3::normalize(Vec3{1, 2, -3});
    sun.irradiance = {1, 5, 1};
    sun.angle = angle;
    const auto scene = SceneBuilder().light(sun).build();
    const LightTable table(scene);
    const Vec3 center = -sun.direction;
    expect_mean(irradiance(table, {0, 0, 0}, center, 100'000), 5);
    if (angle < 0.1F)  // wholly above a plane that doesn't face it
      expect_mean(irradiance(table, {0, 0, 0}, kUp, 100'000), 5 * double{center.z});
    if (angle > 1e-3F)
      expect_sampled_as_claimed(scene, {0, 0, 0}, {},
                                DirectionCells(to_double(center), 2.4 * std::pow(std::sin(angle / 4), 2)));

    // Its edge is at half the angle.
    const Basis basis = basis_around(center);
    const auto seen_at = [&](double off) {
      const Vec3d way = to_double(basis.z) * std::cos(off) + to_double(basis.x) * std::sin(off);
      return table.escaped(table.viewpoint({}, {}), *UnitVec3::normalize(way)).radiance;
    };
    EXPECT_FALSE(seen_at(0.498 * angle).is_black());
    EXPECT_TRUE(seen_at(0.502 * angle).is_black());
  }
}

TEST(LightTable, SunAndSkyAreSampledAsOne) {
  SunLight sun;
  sun.direction = -UnitVec3::z();
  sun.irradiance = {3, 3, 3};
  sun.angle = 0.5F;
  SceneBuilder b;
  b.light(sun).background({1, 1, 1});
  const auto scene = b.build();
  const LightTable table(scene);
  EXPECT_EQ(table.count(), 2U);
  EXPECT_EQ(table.escaped(table.viewpoint({}, {}), {1, 0, 0}).radiance, (Rgb{1, 1, 1}));
  const double sun_and_sky = table.escaped(table.viewpoint({}, {}), kUp).pdf,
               sky = table.escaped(table.viewpoint({}, {}), {1, 0, 0}).pdf;
  EXPECT_NEAR((sun_and_sky - sky) * 2 * kPi * (1 - std::cos(0.25)) + sky * 4 * kPi, 1, 1e-5);
  Random random(6);
  for (int i = 0; i < 10'000; ++i) {
    const auto sample = table.sample(table.viewpoint({0, 0, 0}, {}), random_pick(random), random_square(random));
    ASSERT_TRUE(sample);
    EXPECT_EQ(sample->pdf, table.escaped(table.viewpoint({}, {}), sample->to_light).pdf);
    EXPECT_EQ(sample->radiance, table.escaped(table.viewpoint({}, {}), sample->to_light).radiance);
  }
  expect_mean(irradiance(table, {0, 0, 0}, kUp, 200'000), 3 + kPi);
}

TEST(LightTable, LightsBelowTheHorizonArentPicked) {
  const auto from_below = [](float angle) {
    SunLight sun;
    sun.direction = *UnitVec3::normalize(Vec3{1, 0, 0.2F});
    sun.irradiance = {5, 5, 5};
    sun.angle = angle;
    return sun;
  };
  const DirectionalLight above{-UnitVec3::z(), {1, 2, 3}}, below{*UnitVec3::normalize(Vec3{0, 3, 4}), {9, 9, 9}};
  const LightTable table(SceneBuilder().light(below).light(from_below(0.1F)).light(above).build());
  const auto alone = table.viewpoint({5, 6, 7}, kUp);
  for (const float pick : {0.0F, 0.25F, 0.999F}) {
    const auto sample = table.sample(alone, pick, {pick, 0.5F});
    ASSERT_TRUE(sample);
    EXPECT_EQ(sample->radiance, above.irradiance);
    EXPECT_EQ(sample->pdf, 1);
  }
  const Vec3 to_sun = -from_below(0.1F).direction;
  EXPECT_EQ(table.escaped(alone, to_sun).pdf, 0);
  EXPECT_FALSE(table.escaped(alone, to_sun).radiance.is_black());
  for (const Vec3 normal : {Vec3{}, -kUp}) EXPECT_GT(table.escaped(table.viewpoint({5, 6, 7}, normal), to_sun).pdf, 0);
  EXPECT_FALSE(table.sample(table.viewpoint({5, 6, 7}, *UnitVec3::normalize(Vec3{1, 0.9F, -0.1F})), 0.5F, {0.5F, 0.5F}))
      << "where none is above";

  // The centre of a wide sun may be below, and its edge above.
  const LightTable wide(SceneBuilder().light(from_below(1.5F)).light(above).build());
  EXPECT_GT(wide.escaped(wide.viewpoint({}, kUp), *UnitVec3::normalize(Vec3{-1, 0, 0.2F})).pdf, 0);
}

TEST(LightTable, WhatIsNearAndWhatIsFarArePickedByTheirIrradiance) {
  const PointLight near{{0, 0, 2}, {4, 4, 4}};                                              // 1 W/m²
  const DirectionalLight far{*UnitVec3::normalize(Vec3{0, 3, -4}), {3.75F, 3.75F, 3.75F}};  // 3 W/m²
  const LightTable table(SceneBuilder().light(near).light(far).build());
  const auto pdf = [&](Vec3d point, Vec3 normal, float u) {
    const auto sample = table.sample(table.viewpoint(point, normal), 0.5F, {u, 0.5F});
    return sample ? sample->pdf : 0;
  };
  EXPECT_NEAR(pdf({0, 0, 0}, kUp, 0), 0.75, 1e-6);
  EXPECT_NEAR(pdf({0, 0, 0}, kUp, 0.749F), 0.75, 1e-6);
  EXPECT_NEAR(pdf({0, 0, 0}, kUp, 0.751F), 0.25, 1e-6);
  EXPECT_NEAR(pdf({0, 0, 0}, {}, 0), 3.75 / 4.75, 1e-6);
  EXPECT_NEAR(pdf({0, 0, 1}, kUp, 0), 3.0 / 7, 1e-6) << "nearer";
  EXPECT_EQ(pdf({0, 0, 3}, kUp, 0), 1) << "the point is below";
  EXPECT_EQ(pdf({0, 0, 0}, {0, 1, 0}, 0.999F), 1) << "the direction is";
  // None is forgotten, as what stands between isn't known.
  EXPECT_GT(pdf({0, 0, -1000}, kUp, 0.999F), 0.01);
  EXPECT_GT(pdf({0, 0, 1.999}, kUp, 0), 0.01);
}

TEST(LightTable, NearAndFarTogetherAreSampledAsClaimed) {
  SceneBuilder b;
  SunLight sun;
  sun.direction = *UnitVec3::normalize(Vec3{1, 0, -0.5F});
  sun.irradiance = {3, 3, 3};
  sun.angle = 1.2F;
  b.light(sun);
  b.add(Quad{{{{1, -1, 2}, {1, 1, 2}, {3, 1, 1}, {3, -1, 1}}}}, b.material(glowing({1, 1, 1}, true)));
  const auto scene = b.build();
  const Vec3 tilted = *UnitVec3::normalize(Vec3{0.5F, 0.1F, 1});
  for (const Vec3 normal : {Vec3{}, tilted})
    expect_sampled_as_claimed(scene, {0, 0, 0}, normal, DirectionCells({0, 0, 1}, 2));
}

TEST(LightTable, AllKindsTogetherGiveTheSumOfEach) {
  SceneBuilder b;
  b.light(PointLight{{1, 0, 2}, {0, 3, 0}});
  b.light(DirectionalLight{-UnitVec3::z(), {0, 1, 0}});
  SunLight sun;
  sun.direction = *UnitVec3::normalize(Vec3{1, 0, -2});
  sun.irradiance = {0, 2, 0};
  b.light(sun);
  b.background({0, 0.5F, 0});
  const auto glow = b.material(glowing({0, 1, 0}));
  b.add(Sphere{{-2, 1, 3}, 0.5F}, glow);
  b.add(Quad{{{{3, -1, 1}, {3, 1, 1}, {3, 1, 2}, {3, -1, 2}}}}, b.material(glowing({0, 4, 0}, true)));
  const auto scene = b.build();
  const LightTable table(scene);
  EXPECT_EQ(table.count(), 6U);
  EXPECT_GT(table.count(), 1U);

  // Each alone, in scenes of their own; the environment stands behind them all, and is hidden by what is near.
  double right = 0;
  const auto alone = [&](auto fill) {
    SceneBuilder one;
    fill(one);
    const auto its_scene = one.build();
    return irradiance(LightTable(its_scene), {0, 0, 0}, kUp, 400'000).mean();
  };
  right += 3 * 2 / std::pow(5, 1.5) + 1 + 2 * 2 / std::sqrt(5.0);
  right += 0.5 * kPi;
  right += kPi * 0.25 / 14 * 3 / std::sqrt(14.0);
  right += alone([&](SceneBuilder& one) {
    one.add(Quad{{{{3, -1, 1}, {3, 1, 1}, {3, 1, 2}, {3, -1, 2}}}}, one.material(glowing({0, 4, 0}, true)));
  });
  // Nothing hides anything at the level of the table.
  const Moments found = irradiance(table, {0, 0, 0}, kUp, 1'000'000);
  EXPECT_NEAR(found.mean(), right, 4 * found.standard_error());
}

TEST(LightTable, WhatCantBeSampledStillEmits) {
  SceneBuilder b;
  const auto glow = b.material(glowing({1, 2, 3}));
  b.add(Cylinder{{0, 0, -1}, {0, 0, 1}, 0.5F}, glow).add(Cone{{3, 0, -1}, 0.5F, {3, 0, 1}, 0.1F}, glow);
  const auto scene = b.build();
  const LightTable table(scene);
  EXPECT_TRUE(table.empty());
  EXPECT_EQ(seen(table, *scene, {-3, 0, 0}, {1, 0, 0}), (Rgb{1, 2, 3}));
  EXPECT_EQ(claimed_pdf(table, *scene, {-3, 0, 0}, {}, {1, 0, 0}), 0);
}

TEST(LightTable, ManyLampsAreSampledAsClaimed) {
  SceneBuilder b;
  const auto glow = b.material(glowing({1, 2, 3})), both = b.material(glowing({5, 5, 5}, true));
  Random random(21);
  for (int i = 0; i < 12; ++i) {
    const Vec3 at = to_float(random.in_cube() * 3 + Vec3d{0, 0, 6});
    b.add(Sphere{at, static_cast<float>(random.uniform(0.2, 0.8))}, i % 3 ? glow : both);
  }
  const auto scene = b.build();
  // Some stand before others, which then are sampled in vain: so only what is told of one direction is compared.
  const LightTable table(scene);
  int compared = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 normal = i % 2 ? kUp : Vec3{};
    const auto sample = table.sample(table.viewpoint({0, 0, 0}, normal), random_pick(random), random_square(random));
    ASSERT_TRUE(sample);
    const auto met = meet(*scene, {0, 0, 0}, sample->to_light);
    if (!met || met->primitive.object != sample->primitive.object) continue;
    ++compared;
    const double claimed =
        table.pdf_hit(table.viewpoint({0, 0, 0}, normal), sample->to_light, met->primitive, met->distance, met->normal);
    EXPECT_NEAR(claimed / sample->pdf, 1, 1e-5);
  }
  EXPECT_GT(compared, 8'000);
}

TEST(LightTable, TinyAndHugeScenesAreAlike) {
  double first = 0;
  for (const float scale : {1.0F, 1e-15F, 1e15F}) {
    SceneBuilder b;
    const auto glow = b.material(glowing());
    b.add(Sphere{{0, 0, 2 * scale}, scale / 2}, glow);
    const auto at = [&](float x, float y, float z) { return Vec3{x * scale, y * scale, z * scale}; };
    b.add(Quad{{{at(1, 0, 1), at(1, 1, 1), at(1, 1, 2), at(1, 0, 2)}}}, b.material(glowing({1, 1, 1}, true)));
    b.add(Disk{at(-1, 0, 1), *UnitVec3::normalize(Vec3{1, 0, -1}), scale / 2}, glow);
    const auto scene = b.build();
    const LightTable table(scene);
    EXPECT_EQ(table.count(), 3U);
    const Moments found = irradiance(table, {0, 0, 0}, kUp, 100'000);
    EXPECT_GT(found.mean(), 0.1);
    if (scale == 1)
      first = found.mean();
    else
      EXPECT_NEAR(found.mean() / first, 1, 0.02);
  }
}

}  // namespace
}  // namespace tessera::light_checks
