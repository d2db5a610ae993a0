#include "core/light/emissive_surface.h"

#include <array>
#include <memory>

#include "tests/support/scenes.h"
#include "tests/unit/core/light/light_checks.h"

namespace tessera::light_checks {
namespace {

std::shared_ptr<const Scene> lamp(Shape shape, bool both_sides = false, std::optional<Transform> placement = {}) {
  SceneBuilder b;
  const auto light = b.material(glowing({1, 2, 3}, both_sides));
  b.place(b.shape(std::move(shape)), light, placement);
  return b.build();
}

TriangleMesh mesh_of(std::vector<Vec3> corners) {
  TriangleMesh mesh{std::move(corners), {}, {}};
  for (std::uint32_t i = 2; i < mesh.positions.size(); ++i) mesh.triangles.push_back({0, i - 1, i});
  return mesh;
}

/// Irradiance from a polygon of radiance 1, all of it above the plane (Lambert 1760; Baum et al. 1989).
double lambert(const std::vector<Vec3>& polygon, Vec3 from, Vec3 normal) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3d a = to_double(polygon[i]) - to_double(from);
    const Vec3d b = to_double(polygon[(i + 1) % polygon.size()]) - to_double(from);
    const Vec3d across = cross(a, b);
    sum += std::atan2(length(across), dot(a, b)) * dot(across / length(across), to_double(normal));
  }
  return std::abs(sum) / 2;
}

const Vec3 kFrom{0.25F, 0.5F, -1};

TEST(EmissiveSurface, TrianglesAreSampledAsClaimed) {
  const auto scene = lamp(mesh_of({{1, 0, 1}, {0, 1.5F, 1.25F}, {-1, 0, 1}}), true);
  expect_sampled_as_claimed(scene, kFrom, {}, DirectionCells({-0.2, 0, 2.1}, 0.3));
  expect_sampled_as_claimed(scene, {0, 0.5F, 0.9F}, {}, DirectionCells({0, 0, 1}, 2));
}

TEST(EmissiveSurface, QuadsAreSampledAsClaimedFoldedOnesToo) {
  const auto flat = lamp(Quad{{{{-1, -1, 1}, {-1, 1, 1}, {1, 1, 1}, {1, -1, 1}}}});
  expect_sampled_as_claimed(flat, kFrom, kUp, DirectionCells({-0.2, -0.4, 2}, 0.35));
  expect_sampled_as_claimed(flat, {0.25F, 0.5F, 0.7F}, kUp, DirectionCells({0, 0, 1}, 2));
  const auto folded = lamp(Quad{{{{-1, -1, 1}, {-1, 1, 0.5F}, {1, 1, 1}, {1, -1, 0.25F}}}}, true);
  expect_sampled_as_claimed(folded, kFrom, {}, DirectionCells({-0.2, -0.4, 1.7}, 0.5), false);
}

/// A dart's corners may be told from any on. Cut along its axis it is sampled, cut across it isn't: then its halves lie
/// one upon the other, and what is in both would be found twice.
TEST(EmissiveSurface, DartsAreSampledWhereTheirHalvesPartThem) {
  const std::array<Vec3, 4> dart{{{0, 1, 1}, {-1, -1, 1}, {0, 0.2F, 1}, {1, -1, 1}}};
  const auto along = lamp(Quad{dart}, true), across = lamp(Quad{{{dart[1], dart[2], dart[3], dart[0]}}}, true);
  expect_sampled_as_claimed(along, {0, 0.25F, 0.5F}, {}, DirectionCells({0, 0, 1}, 0.75));
  expect_sampled_as_claimed(along, {0, 0.25F, -2}, {}, DirectionCells({0, -0.25, 3}, 0.15));
  EXPECT_EQ(LightTable(along).count(), 1U);
  EXPECT_EQ(LightTable(across).count(), 0U);
}

TEST(EmissiveSurface, DisksAreSampledAsClaimed) {
  const Disk disk{{0.5F, 0, 1}, *UnitVec3::normalize(Vec3{0.2F, -0.5F, -1}), 0.75F};
  expect_sampled_as_claimed(lamp(disk), kFrom, {}, DirectionCells({0.25, -0.5, 2}, 0.12));
}

TEST(EmissiveSurface, SpheresAreSampledAsClaimedFromOutsideAndInside) {
  const auto scene = lamp(Sphere{{0, 0, 2}, 1.5F}, true);
  expect_sampled_as_claimed(scene, kFrom, {}, DirectionCells({-0.25, -0.5, 3}, 0.2));
  expect_sampled_as_claimed(scene, {0.5F, 0.25F, 3}, {}, DirectionCells({0, 0, 1}, 2));
}

TEST(EmissiveSurface, PlacedOnesAreSampledAsClaimed) {
  // Turned, stretched and mirrored; a turned sphere remains one, a stretched one doesn't.
  const DirectionCells wide({0.25, -0.5, 2}, 0.6);
  const Transform turned = placed({0, -2, 0, 0.5, 2, 0, 0, 0, 0, 0, 2, 2});
  const Transform stretched = placed({1.5, 0.5, 0, 0.5, 0, -0.75, 0.25, 0, 0, 0.25, 0.5, 1});
  expect_sampled_as_claimed(lamp(Sphere{{0, 0, 0}, 1}, false, turned), {0.25F, 0.5F, -1}, {},
                            DirectionCells({0.25, -0.5, 3}, 0.4));
  expect_sampled_as_claimed(lamp(Sphere{{0, 0, 0}, 1}, false, stretched), {0.25F, 0.5F, -1}, {}, wide, false);
  expect_sampled_as_claimed(lamp(Disk{{0, 0, 0}, UnitVec3::z(), 1}, true, stretched), {0.25F, 0.5F, -1}, {}, wide);
  expect_sampled_as_claimed(lamp(mesh_of({{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}}), true, stretched), {0.25F, 0.5F, -1}, {},
                            wide);
  expect_sampled_as_claimed(lamp(Sphere{{0, 0, 0}, 1}, true, stretched), {0.5F, 0.25F, 1}, {},
                            DirectionCells({0, 0, 1}, 2));
}

TEST(EmissiveSurface, Stress57_PolygonsLightAsLambertSays) {
  const std::vector<std::vector<Vec3>> polygons = {
      {{1, 0, 1}, {0, 1, 1}, {-1, 0, 1}},                                                   // a triangle
      {{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}},                                     // a square
      {{0.01F, 0, 0.05F}, {0, 0.01F, 0.05F}, {-0.01F, 0, 0.05F}},                           // small and near
      {{2, -3, 0.5F}, {2, 3, 0.5F}, {2, 3, 4}, {2, -3, 4}},                                 // beside
      {{1, 0, 2}, {0.5F, 1, 2}, {-0.5F, 1, 2}, {-1, 0, 2}, {-0.5F, -1, 2}, {0.5F, -1, 2}},  // a hexagon
      {{1e4F, 0, 1e4F}, {1e4F, 10, 1e4F}, {-1e4F, 0, 1e4F}},                                // a long needle
  };
  const Vec3 from{0, 0, 0};
  for (const auto& polygon : polygons) {
    SCOPED_TRACE(&polygon - polygons.data());
    const double right = 2 * lambert(polygon, from, kUp);  // radiance 2 in green
    const auto as_mesh = lamp(mesh_of(polygon), true);
    expect_mean(irradiance(LightTable(as_mesh), from, kUp, 200'000), right);
    if (polygon.size() != 4) continue;
    const auto as_quad = lamp(Quad{{{polygon[0], polygon[1], polygon[2], polygon[3]}}}, true);
    expect_mean(irradiance(LightTable(as_quad), from, kUp, 200'000), right);
  }
}

TEST(EmissiveSurface, SpheresAndDisksLightAsTheirFormFactorsSay) {
  const Vec3 from{0, 0, 0};
  for (const float distance : {1.001F, 1.5F, 4.0F, 1e3F, 1e6F}) {
    SCOPED_TRACE(distance);
    // Straight above: a sphere gives π L (r/d)², a disk π L r² / (r² + d²).
    const double sphere = 2 * kPi / (double{distance} * distance);
    const auto ball = lamp(Sphere{{0, 0, distance}, 1});
    expect_mean(irradiance(LightTable(ball), from, kUp, 100'000), sphere);
    const auto disk = lamp(Disk{{0, 0, distance}, -UnitVec3::z(), 1});
    expect_mean(irradiance(LightTable(disk), from, kUp, 100'000), 2 * kPi / (1.0 + double{distance} * distance));
  }
}

TEST(EmissiveSurface, AnEllipsoidLightsAsFarAsItsOutlineReaches) {
  // From afar by its cross section, π a b.
  const auto scene = lamp(Sphere{{0, 0, 0}, 1}, false, placed({3, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 2, 1000}));
  const Moments found = irradiance(LightTable(scene), {0, 0, 0}, kUp, 400'000);
  EXPECT_NEAR(found.mean(), 2 * kPi * 3 * 0.5 / 1e6, 5e-5 * found.mean() + 4 * found.standard_error());
}

TEST(EmissiveSurface, Stress72_OneSidedLightLeavesTheFrontAlone) {
  const Quad facing_up{{{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}}};
  const Transform mirrored = placed({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0});
  const Random random(3);
  for (const bool mirror : {false, true}) {
    const auto one = lamp(facing_up, false, mirror ? std::optional(mirrored) : std::nullopt);
    const auto both = lamp(facing_up, true, mirror ? std::optional(mirrored) : std::nullopt);
    const Vec3 front{0.25F, 0, mirror ? -2.0F : 2.0F};
    EXPECT_GT(irradiance(LightTable(one), front, *UnitVec3::normalize(-front), 1000).mean(), 0);
    EXPECT_EQ(irradiance(LightTable(one), -front, *UnitVec3::normalize(front), 1000).mean(), 0);
    EXPECT_GT(irradiance(LightTable(both), -front, *UnitVec3::normalize(front), 1000).mean(), 0);
    EXPECT_TRUE(seen(LightTable(one), *one, -front, *UnitVec3::normalize(front)).is_black());
    EXPECT_EQ(seen(LightTable(one), *one, front, *UnitVec3::normalize(-front)), (Rgb{1, 2, 3}));
    EXPECT_EQ(seen(LightTable(both), *both, -front, *UnitVec3::normalize(front)), (Rgb{1, 2, 3}));
  }
}

TEST(EmissiveSurface, Stress72_TrianglesAreAsBrightAsTheQuadTheyTile) {
  TriangleMesh tiles;
  constexpr int kAcross = 12;
  for (int y = 0; y <= kAcross; ++y)
    for (int x = 0; x <= kAcross; ++x)
      tiles.positions.push_back(
          {2.0F * static_cast<float>(x) / kAcross - 1, 2.0F * static_cast<float>(y) / kAcross - 1, 1});
  for (std::uint32_t y = 0; y < kAcross; ++y)
    for (std::uint32_t x = 0; x < kAcross; ++x) {
      const std::uint32_t a = y * (kAcross + 1) + x, b = a + 1, c = a + kAcross + 1, d = c + 1;
      tiles.triangles.push_back({a, c, b});
      tiles.triangles.push_back({b, c, d});
    }
  const auto tiled = lamp(tiles);
  EXPECT_EQ(LightTable(tiled).count(), 2U * kAcross * kAcross);
  const auto quad = lamp(Quad{{{{-1, -1, 1}, {-1, 1, 1}, {1, 1, 1}, {1, -1, 1}}}});
  for (const Vec3 from : {Vec3{0, 0, 0}, Vec3{0.9F, -0.4F, 0.9F}, Vec3{5, 1, -2}}) {
    const Moments a = irradiance(LightTable(tiled), from, kUp, 200'000, 1);
    const Moments b = irradiance(LightTable(quad), from, kUp, 200'000, 2);
    EXPECT_GT(welch_test(a, b), 1e-3);
    if (from.x < 1) continue;  // The quad is sampled by solid angle there.
    EXPECT_LT(a.standard_error(), b.standard_error()) << "the nearer triangles are picked more often";
  }
}

TEST(EmissiveSurface, Stress72_TrianglesWithoutAreaAreNeverSampled) {
  TriangleMesh mesh{{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {0.1F, 0.1F, 1}, {0.3F, 0.3F, 1}, {0.7F, 0.7F, 1}}, {}, {}};
  mesh.triangles = {{3, 4, 5}, {0, 2, 1}, {0, 0, 1}, {3, 5, 4}};
  const auto scene = lamp(mesh);
  const LightTable table(scene);
  EXPECT_EQ(table.count(), 1U);
  EXPECT_EQ(table.count(), 1U);
  Random random(5);
  for (int i = 0; i < 1000; ++i) {
    const auto sample = table.sample(table.viewpoint({0, 0, 0}, {}), random_pick(random), random_square(random));
    ASSERT_TRUE(sample);
    EXPECT_EQ(sample->primitive.primitive, 1U);
  }
  for (const std::uint32_t primitive : {0U, 2U, 3U})
    EXPECT_EQ(table.pdf_hit(table.viewpoint({0, 0, 0}, {}), kUp, {0, primitive}, 1, {0, 0, -1}), 0);

  mesh.triangles = {{3, 4, 5}};
  EXPECT_TRUE(LightTable(lamp(mesh)).empty());
  mesh.triangles = {};
  EXPECT_TRUE(LightTable(lamp(mesh)).empty());
}

TEST(EmissiveSurface, NoLampIsInItsOwnShadow) {
  // Grazing, far off, huge, tiny, turned: the ray ends before the lamp it leads to, and no more than a little.
  Random random(11);
  int rays = 0;
  for (int seed = 0; seed < 200; ++seed) {
    const double size = random.magnitude(-6, 6), offset = random.magnitude(-6, 6);
    const auto point = [&] { return to_float(random.in_cube() * size + Vec3d{offset, -offset, offset}); };
    const auto triangle = mesh_of({point(), point(), point()});
    const Sphere sphere{point(), static_cast<float>(size * 0.1)};
    const Disk disk{point(), *UnitVec3::normalize(random.direction()), static_cast<float>(size * 0.1)};
    const Vec3d way = random.in_cube();
    const Transform transform = placed({0.5, -1, 0, way.x, 1, 0.25, 0, way.y, 0, 0.5, 2, way.z});
    for (const auto& shape : {Shape(triangle), Shape(sphere), Shape(disk)})
      for (const bool is_placed : {false, true}) {
        const auto scene = lamp(shape, true, is_placed ? std::optional(transform) : std::nullopt);
        const LightTable table(scene);
        Vec3 from = point();
        if (is_placed) from = to_float(transform.point_to_world(to_double(from)));
        for (int i = 0; i < 50; ++i) {
          const auto sample =
              table.sample(table.viewpoint(to_double(from), {}), random_pick(random), random_square(random));
          if (!sample) continue;
          ++rays;
          Ray ray = table.shadow_ray(*sample, from);
          const auto met = meet(*scene, ray.origin, ray.direction);
          if (met) {
            EXPECT_LE(ray.t_max, met->distance) << seed;
            EXPECT_GE(ray.t_max, met->distance * 0.99999) << seed;
          }
        }
      }
  }
  EXPECT_GT(rays, 40'000);
}

TEST(EmissiveSurface, WhatStandsBetweenIsSeen) {
  SceneBuilder b;
  const auto light = b.material(glowing());
  b.add(Quad{{{{-1, -1, 2}, {-1, 1, 2}, {1, 1, 2}, {1, -1, 2}}}}, light);
  b.add(Quad{{{{-9, -9, 1}, {-9, 9, 1}, {9, 9, 1}, {9, -9, 1}}}}, b.material(Material{}));
  const auto scene = b.build();
  const LightTable table(scene);
  const auto sample = table.sample(table.viewpoint({0, 0, 0}, kUp), 0.5F, {0.3F, 0.6F});
  ASSERT_TRUE(sample);
  const Ray ray = table.shadow_ray(*sample, {0, 0, 0});
  const auto met = meet(*scene, ray.origin, ray.direction);
  ASSERT_TRUE(met);
  EXPECT_EQ(met->primitive.object, 1U);
  EXPECT_LT(met->distance, ray.t_max);
}

TEST(EmissiveSurface, WhatIsCutOutByAlphaSendsLess) {
  SceneBuilder b;
  Material half = glowing({2, 2, 2});
  half.alpha = 0.5F;
  b.add(Sphere{{0, 0, 3}, 1}, b.material(half));
  const auto scene = b.build();
  const auto sample = LightTable(scene).sample(LightTable(scene).viewpoint({0, 0, 0}, kUp), 0.5F, {0.5F, 0.25F});
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->radiance, (Rgb{1, 1, 1}));
}

}  // namespace
}  // namespace tessera::light_checks
