#include "core/integrator/whitted.h"

#include <numbers>

#include <gtest/gtest.h>

#include "core/integrator/spawn.h"
#include "core/material/shade.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

const Quad kFloor{{{{-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}}}};
const Quad kCeiling{{{{-9, 8, 9}, {-9, 8, -9}, {9, 8, -9}, {9, 8, 9}}}};

struct Seen {
  Rgb radiance;
  RayCounts rays;
};

Seen look(const std::shared_ptr<const Scene>& scene, const Ray& ray, std::uint32_t max_depth = 5) {
  const auto accel = make_accel(scene, {AccelKind::bvh});
  Seen seen;
  const Hit hit = accel->closest(ray).value_or(Hit{});
  Whitted(*scene, features_of(*scene), *accel, max_depth, seen.rays)
      .radiance({&ray, 1}, {&hit, 1}, {&seen.radiance, 1});
  return seen;
}

const Ray kDown{{1, 5, 0}, {0, -1, 0}};

TEST(Whitted, LambertUnderAPointLight) {
  SceneBuilder b;
  b.material(diffuse({0.5F, 0.25F, 1}));
  const auto scene = b.add(kFloor).light(PointLight{{1, 2, 0}, {8, 8, 8}}).build();
  const Seen seen = look(scene, kDown);
  // E = I / d² = 8 / 4; L = albedo / π · E · cos 0.
  EXPECT_NEAR(seen.radiance.r, 0.5F * 2 / std::numbers::pi_v<float>, 1e-6);
  EXPECT_NEAR(seen.radiance.g, 0.25F * 2 / std::numbers::pi_v<float>, 1e-6);
  EXPECT_EQ(seen.rays.shadow, 1U);
}

TEST(Whitted, LambertUnderASlantedSun) {
  SceneBuilder b;
  b.material(diffuse({1, 1, 1}));
  const auto scene =
      b.add(kFloor)
          .light(DirectionalLight{*UnitVec3::normalize(Vec3{1, -1, 0}),
                                  {std::numbers::pi_v<float>, std::numbers::pi_v<float>, std::numbers::pi_v<float>}})
          .build();
  EXPECT_NEAR(look(scene, kDown).radiance.r, std::numbers::sqrt2_v<float> / 2, 1e-6);
}

TEST(Whitted, ShadowsHideLightsButNotAmbientOnes) {
  SceneBuilder b;
  b.material(diffuse({0.5F, 0.5F, 0.5F}));
  const auto scene = b.add(kFloor)
                         .add(Sphere{{2, 2, 0}, 0.5F})
                         .light(PointLight{{3, 4, 0}, {10, 10, 10}})
                         .light(AmbientLight{{0.2F, 0.2F, 0.2F}})
                         .build();
  EXPECT_FLOAT_EQ(look(scene, kDown).radiance.r, 0.1F);
}

TEST(Whitted, ALampOnASurfaceIsNotInItsOwnShadow_Stress25) {
  SceneBuilder b;
  b.material(diffuse({1, 1, 1}));
  const auto scene = b.add(kFloor)
                         .add(Quad{{{{-9, 3, 9}, {-9, 3, -9}, {9, 3, -9}, {9, 3, 9}}}})
                         .light(PointLight{{2, 3, 1}, {10, 10, 10}})
                         .build();
  EXPECT_GT(look(scene, {{1, 2, 0}, {0, -1, 0}}).radiance.r, 0) << "a lamp in the ceiling lights the floor";
  const auto coplanar = SceneBuilder().add(kFloor).light(PointLight{{4, 0, 1}, {10, 10, 10}}).build();
  EXPECT_EQ(look(coplanar, kDown).radiance.r, 0) << "a light in the floor's own plane grazes it";
}

TEST(Whitted, AMirrorShowsTheBackgroundWeighed) {
  SceneBuilder b;
  b.material(mirror_material());
  const Seen seen = look(b.add(kFloor).background({1, 0.5F, 0.25F}).build(), kDown);
  EXPECT_FLOAT_EQ(seen.radiance.g, 0.45F);
  EXPECT_EQ(seen.rays.reflection, 1U);
  EXPECT_EQ(seen.rays.shadow, 0U);
}

TEST(Whitted, StopsAtTheDepthAskedFor) {
  SceneBuilder b;
  b.material(mirror_material());
  const auto scene = b.add(kFloor).add(kCeiling).build();
  for (const std::uint32_t depth : {1U, 2U, 5U, 64U}) EXPECT_EQ(look(scene, kDown, depth).rays.reflection, depth - 1);
}

TEST(Whitted, AChainEndsWhereItNoLongerShows) {
  const auto reflections = [](Rgb reflect) {
    SceneBuilder b;
    b.material({.diffuse = {}, .reflect = reflect});
    return look(b.add(kFloor).add(kCeiling).build(), kDown, 64).rays.reflection;
  };
  EXPECT_EQ(reflections({0.5F, 0.5F, 0.5F}), 25U) << "0.5^25 is 2^-25, and 0.5^26 is less";
  EXPECT_EQ(reflections({0, 0.5F, 0.25F}), 25U) << "the channel that shows most counts";
  EXPECT_EQ(reflections({0.03125F, 0, 0}), 5U) << "2^-5 to the fifth";
  EXPECT_EQ(reflections({1, 1, 1}), 63U) << "never fades";
  EXPECT_EQ(reflections({0x1p-26F, 0, 0}), 0U) << "not even one";
}

TEST(Whitted, AChainFadesByAllItsSurfaces) {
  SceneBuilder b;
  const auto quarter = b.material({.diffuse = {}, .reflect = {0.25F, 0.25F, 0.25F}});
  const auto red = b.material({.diffuse = {}, .reflect = {0.5F, 0, 0}}),
             blue = b.material({.diffuse = {}, .reflect = {0, 0, 1}});
  const auto fading = SceneBuilder(b).add(kFloor, quarter).add(kCeiling, red).build();
  EXPECT_EQ(look(fading, kDown, 64).rays.reflection, 16U)
      << "eight rounds of 3 bits make 2^-24, and 2 bits more are too many";
  const auto crossed = SceneBuilder(b).add(kFloor, red).add(kCeiling, blue).build();
  EXPECT_EQ(look(crossed, kDown, 64).rays.reflection, 1U) << "red is all that is left, and blue glass all that comes";
}

const WhittedSurface kPane{.diffuse = {}, .reflect = {1, 1, 1}, .transmit = {1, 1, 1}};

/// A pane that splits every ray in two without loss, in the middle of a mirror all around.
std::shared_ptr<const Scene> pane_in_a_mirror() {
  SceneBuilder b;
  const auto mirror = b.material({.diffuse = {}, .reflect = {1, 1, 1}}), pane = b.material(kPane);
  return b.add(Sphere{{0, 0, 0}, 6}, mirror).add(kFloor, pane).build();
}

TEST(Whitted, BranchesAreFollowedInFullToUsualDepths) {
  const Ray along_the_axis{{0, 5, 0}, {0, -1, 0}};
  const Seen seen = look(pane_in_a_mirror(), along_the_axis, 5);
  EXPECT_EQ(seen.rays.reflection, 1U + 2 + 2 + 4) << "the pane, the sphere from both sides, the pane twice, …";
  EXPECT_EQ(seen.rays.refraction, 1U + 0 + 2 + 0);
  const Seen deep = look(pane_in_a_mirror(), along_the_axis, 20);
  EXPECT_EQ(deep.rays.reflection + deep.rays.refraction, 2U * (2 + 4 + 8 + 16 + 32 + 64 + 128 + 256 + 512) + 1024);
}

TEST(Whitted, NoBranchIsMissingDownToTheUsualDepth) {
  for (const float reflect : {1.0F, 0.25F, 0x1p-6F})
    for (const auto& [mirrors, passes] : {std::pair{reflect, 1.0F}, {1.0F, reflect}}) {
      SceneBuilder b;
      b.material({.diffuse = {}, .reflect = {mirrors, 0, 0}, .transmit = {passes, 0, 0}});
      for (int i = -6; i < 6; ++i) {  // so many that no ray gets out
        const float y = static_cast<float>(i) + 0.5F;
        b.add(Quad{{{{-9, y, 9}, {9, y, 9}, {9, y, -9}, {-9, y, -9}}}});
      }
      const Seen seen = look(b.build(), {{1, 0, 0}, {0, -1, 0}}, 5);
      EXPECT_EQ(seen.rays.reflection, 1U + 2 + 4 + 8) << mirrors << " " << passes;
      EXPECT_EQ(seen.rays.refraction, 1U + 2 + 4 + 8) << mirrors << " " << passes;
    }
}

TEST(Whitted, BranchesThatNeverFadeEnd) {
  const Seen seen = look(pane_in_a_mirror(), {{0.5F, 3, 0.25F}, {0.1F, -1, 0.3F}}, 64);
  EXPECT_EQ(seen.rays.reflection + seen.rays.refraction, Whitted::kMostSecondary) << "no ray gets out";
}

TEST(Whitted, WhatIsCutIsHardlyMissedInAStackOfGlass) {
  // Panes that lose nothing: each light path arrives at the background somewhere, at whatever depth.
  SceneBuilder b;
  b.material({.diffuse = {}, .reflect = {0.04F, 0.04F, 0.04F}, .transmit = {0.96F, 0.96F, 0.96F}});
  for (int i = 0; i < 8; ++i) {
    const auto y = static_cast<float>(-i);
    b.add(Quad{{{{-9, y, 9}, {9, y, 9}, {9, y, -9}, {-9, y, -9}}}});
  }
  const Seen seen = look(b.background({1, 1, 1}).build(), kDown, 64);
  EXPECT_NEAR(seen.radiance.r, 1, 0.01);
  EXPECT_LE(seen.rays.reflection + seen.rays.refraction, Whitted::kMostSecondary);
}

TEST(Whitted, CutsDontDependOnTheBatch) {
  const auto scene = pane_in_a_mirror();
  const auto accel = make_accel(scene, {AccelKind::bvh});
  Random random(0);
  std::vector<Ray> rays;
  for (int i = 0; i < 20; ++i) rays.push_back({{0, 3, 0}, to_float(random.direction())});
  std::vector<Hit> hits(rays.size());
  accel->closest(rays, hits);
  RayCounts together, one_by_one;
  std::vector<Rgb> batch(rays.size());
  Whitted(*scene, features_of(*scene), *accel, 64, together).radiance(rays, hits, batch);
  Whitted alone(*scene, features_of(*scene), *accel, 64, one_by_one);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    Rgb radiance;
    alone.radiance({&rays[i], 1}, {&hits[i], 1}, {&radiance, 1});
    EXPECT_EQ(radiance, batch[i]);
  }
  EXPECT_EQ(together, one_by_one);
  EXPECT_EQ(together.reflection + together.refraction, rays.size() * Whitted::kMostSecondary);
}

TEST(Whitted, WhiteGlassAndMirrorVanishInAConstantEnvironment) {
  SceneBuilder b;
  b.material(glass_material());
  const auto scene = b.add(Sphere{{0, 0, 0}, 1}).background({1, 1, 1}).build();
  for (const float x : {0.0F, 0.3F, 0.9F}) {
    // 40 reflections deep, 5% of 5% of … is left out; total reflection doesn't occur in a sphere entered from outside.
    EXPECT_NEAR(look(scene, {{x, 0, 4}, {0, 0, -1}}, 12).radiance.r, 1, 1e-3) << x;
  }
}

TEST(Shade, PhongPeaksInTheMirrorDirection) {
  const WhittedSurface m{.diffuse = {}, .specular = {1, 1, 1}, .shininess = 10};
  const Vec3 n{0, 1, 0}, viewer = to_float(Vec3d{0.6, 0.8, 0}), light{-0.6F, 0.8F, 0};
  EXPECT_NEAR(
      shade(m, n, viewer, light, {std::numbers::pi_v<float>, std::numbers::pi_v<float>, std::numbers::pi_v<float>}).r,
      1, 1e-5);
  EXPECT_NEAR(
      shade(m, n, {0, 1, 0}, light, {std::numbers::pi_v<float>, std::numbers::pi_v<float>, std::numbers::pi_v<float>})
          .r,
      std::pow(0.8F, 10.0F), 1e-5);
  EXPECT_EQ(shade(m, n, viewer, {0.6F, -0.8F, 0}, {1, 1, 1}), Rgb{}) << "from below";
}

TEST(Shade, RefractsBySnellAndReflectsTotally) {
  const Vec3 n{0, 1, 0};
  const Vec3 in{std::sin(0.5F), -std::cos(0.5F), 0};
  const auto out = refract(in, n, 1.5F);
  ASSERT_TRUE(out);
  EXPECT_NEAR(out->x, std::sin(0.5F) / 1.5F, 1e-6);
  EXPECT_NEAR(length(*out), 1, 1e-6);
  EXPECT_FALSE(refract({std::sin(1.0F), -std::cos(1.0F), 0}, n, 1 / 1.5F)) << "beyond the critical angle of 41.8°";
  EXPECT_EQ(fresnel({std::sin(1.0F), -std::cos(1.0F), 0}, n, 1 / 1.5F), 1);
  EXPECT_NEAR(fresnel({0, -1, 0}, n, 1.5F), 0.04F, 1e-6) << "((n − 1) / (n + 1))²";
  // Brewster's angle: what is reflected is all polarised across, ((n² − 1) / (n² + 1))² of half.
  const float brewster = std::atan(1.5F);
  EXPECT_NEAR(fresnel({std::sin(brewster), -std::cos(brewster), 0}, n, 1.5F), std::pow(1.25F / 3.25F, 2.0F) / 2, 1e-6);
}

/// Rays that leave a surface, to its own side, never meet it again (STRESS 24).
TEST(Spawn, NeverMeetsItsOwnSurfaceAgain_Stress24) {
  int spawned = 0;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    Random random(seed);
    const double size = random.magnitude(-4, 4), shift = random.magnitude(-8, 8);
    Shape shape = random_shape(random, size);
    const bool convex = !std::holds_alternative<TriangleMesh>(shape);
    const Vec3d offset = random.in_cube() * shift;
    SceneBuilder b;
    b.place(b.shape(shape), 0,
            seed % 2 ? Transform::from_rows({1, 0, 0, offset.x, 0, 1, 0, offset.y, 0, 0, 1, offset.z}) : std::nullopt);
    const auto one = b.build();
    const auto accel = make_accel(one, {AccelKind::bvh});
    const Aabb box = world_bounds(*one, one->objects[0]);
    for (int i = 0; i < 50; ++i) {
      Vec3 target;
      for (int axis = 0; axis < 3; ++axis)
        target[axis] = static_cast<float>(random.uniform(box.lo[axis], box.hi[axis]));
      const Vec3 origin = to_float(to_double(target) + random.direction() * (size * 10));
      const auto hit = accel->closest({origin, target - origin});
      if (!hit) continue;
      const SurfacePoint at = world_surface(*one, hit->object, hit->primitive, {origin, target - origin}, hit->t);
      const Vec3d outward =
          dot(at.geometric_normal, to_double(origin - target)) < 0 ? -at.geometric_normal : at.geometric_normal;
      for (int k = 0; k < 20; ++k) {
        Vec3d way = random.direction();
        if (dot(way, outward) < 0) way = -way;
        const Vec3 from = spawn_origin(at, way);
        const auto again = accel->closest({from, to_float(way)});
        ++spawned;
        // The inner side of a hollow shape may see its own far wall; nothing may be met close by.
        const bool hollow = !convex || std::holds_alternative<Sphere>(shape) ||
                            std::holds_alternative<Cylinder>(shape) || std::holds_alternative<Cone>(shape);
        if (again && (!hollow || again->t < size * 1e-7)) {
          ADD_FAILURE() << "seed " << seed << ": shape " << shape.index() << " met again at t = " << again->t
                        << " size " << size << " shift " << shift;
          return;
        }
      }
    }
  }
  EXPECT_GT(spawned, 100'000);
}

}  // namespace
}  // namespace tessera
