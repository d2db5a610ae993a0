// STRESS 22 and 28–35: quadrics, planes and transforms at the limits, in every structure × bound × space; the
// primitives alone are in quadrics_*_test and transform_normals_test.
#include <gtest/gtest.h>

#include "core/integrator/spawn.h"
#include "proto/parse.h"
#include "tests/property/stress_scenes.h"
#include "tests/support/effort.h"
#include "tests/support/image.h"
#include "tests/support/no_files.h"
#include "tests/support/same_hits.h"
#include "tests/support/wide_oracle.h"

namespace tessera {
namespace {

/// Spheres of radius 1 in a loose heap, seen from 10³ to 10⁷ away, at their silhouettes as often as not.
TEST(StressQuadrics, UnitSpheresFromAfar_Stress28) {
  SceneBuilder b;
  Random random(28);
  std::vector<Vec3> centers;
  for (int i = 0; i < 40; ++i) centers.push_back(to_float(random.in_cube() * 12));
  for (const Vec3 center : centers) b.add(Sphere{center, 1});
  const auto scene = b.build();
  std::vector<Ray> rays;
  for (int i = 0; i < effort(4000, 200'000); ++i) {
    const Vec3 origin = to_float(random.direction() * random.magnitude(3, 7));
    const double off = i % 2 ? random.uniform(0, 1) : 1 + random.uniform(-1e-5, 1e-5);
    const Vec3d target = to_double(centers[random.bits() % centers.size()]) + random.direction() * off;
    rays.push_back({origin, to_float(target - to_double(origin))});
  }
  const auto known = known_rays(scene, rays);
  int hits = 0;
  for (std::size_t i = 0; i < known.size(); ++i) {
    const WideAnswer exact = wide_trace(*scene, known[i].ray);
    const Wide reach = length(to_double(known[i].ray.origin)) + 13;
    if (exact.margin < 64 * 0x1p-53L * reach) continue;  // as near to a silhouette as doubles know the ray
    ASSERT_EQ(known[i].hit.has_value(), !exact.hits.empty()) << "ray " << i;
    if (!known[i].hit) continue;
    ++hits;
    const Wide t = exact.closest()->t, graze = 64 * 0x1p-53L / exact.closest()->steepness;
    EXPECT_LE(std::abs(known[i].hit->t - t), 2 * ulp(t) + graze) << "ray " << i;
  }
  EXPECT_GT(hits, effort(4000, 200'000) / 2);
  expect_same_hits_everywhere(scene, known, "from afar");
}

/// A triangle and a quad 10⁷ away, filling half of a picture: every pixel is what exact arithmetic says, unless an edge
/// passes it within rounding.
TEST(StressQuadrics, FlatShapesFromTenMillionMetres_Stress22) {
  const TriangleMesh triangle{{{-40, -40, -1e7F}, {40, -40, -1e7F}, {0, 0, -1e7F}}, {{0, 1, 2}}, {}};
  const auto scene = SceneBuilder().add(triangle).add(flat_quad(2, {-30, 5, -1e7F}, 60, 30)).build();
  const Camera camera = PerspectiveCamera{{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}}, 1e-5F};
  Settings settings;
  settings.width = settings.height = 48;
  settings.jitter = false;
  settings.aovs = {Aov::object_id, Aov::depth};
  settings.accel.kind = AccelKind::brute;
  settings.screen_bounds = ScreenBounds::off;
  const Pixels expected = render_image(scene, camera, settings).pixels;
  const CameraRays rays(camera, 48, 48);
  int hits = 0, unsure = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 48; ++x) {
      const WideAnswer exact = wide_trace(*scene, rays.ray(x + 0.5, y + 0.5));
      if (exact.margin < 1e-7L) {
        ++unsure;
        continue;
      }
      const std::uint32_t id = expected.plane<std::uint32_t>(Aov::object_id)[expected.index(x, y)];
      if (exact.hits.empty()) {
        EXPECT_GT(id, 1U) << x << ' ' << y;
        continue;
      }
      ++hits;
      EXPECT_EQ(id, exact.closest()->object) << x << ' ' << y;
    }
  EXPECT_GT(hits, 500);
  EXPECT_LT(unsure, 100);
  for (const AccelOptions& options : accel_choices())
    for (const ScreenBounds bounds : {ScreenBounds::off, ScreenBounds::flat, ScreenBounds::hierarchical}) {
      settings.accel = options;
      settings.screen_bounds = bounds;
      EXPECT_TRUE(same_bytes(expected, render_image(scene, camera, settings).pixels)) << describe(options);
    }
}

/// A ground of 1000 km radius among things of a metre, from a metre above: the same everywhere, and no acne.
TEST(StressQuadrics, AGroundSphere_Stress29) {
  SceneBuilder b;
  b.add(Sphere{{0, -1e6F, 0}, 1e6F});
  Random random(29);
  for (int i = 0; i < 20; ++i) b.add(Sphere{to_float({random.uniform(-20, 20), 1.5, random.uniform(-60, -5)}), 0.5F});
  const auto scene = b.build();
  std::vector<Ray> rays;
  for (int i = 0; i < effort(2000, 100'000); ++i)
    rays.push_back(
        {{0, 1, 0}, to_float({random.uniform(-0.7, 0.7), random.uniform(-0.5, 0.1) * random.magnitude(-4, 0), -1})});
  const auto known = known_rays(scene, rays);
  expect_same_hits_everywhere(scene, known, "ground");
  std::vector<KnownRay> upward;
  for (const auto& [ray, hit] : known) {
    if (!hit || hit->object != 0) continue;
    const SurfacePoint at = world_surface(*scene, 0, 0, ray, hit->t);
    upward.push_back({{spawn_origin(at, {0, 1, 0}), {0, 1, 0}, 0, 0.9F}, {}});  // the balls float a metre up
  }
  EXPECT_GT(upward.size(), known.size() / 3);
  expect_same_hits_everywhere(scene, upward, "shadow rays");

  // The horizon is sqrt(2·h/r) below level: hit below it, missed above it, a pixel of 1/1024 radian on either side.
  const double horizon = std::sqrt(2 / 1e6), pixel = 1.0 / 1024;
  const auto ground = SceneBuilder().add(Sphere{{0, -1e6F, 0}, 1e6F}).build();
  for (const AccelOptions& options : accel_choices()) {
    const auto accel = make_accel(ground, options);
    const auto is_hit = [&](double up) { return accel->closest({{0, 1, 0}, to_float({0, up, -1})}).has_value(); };
    EXPECT_TRUE(is_hit(-horizon - pixel)) << describe(options);
    EXPECT_FALSE(is_hit(-horizon + pixel)) << describe(options);
  }
}

TEST(StressQuadrics, TinyBesideHuge_Stress30) {
  SceneBuilder b;
  b.add(Sphere{{0, -1e6F, 0}, 1e6F});
  Random random(30);
  std::vector<Sphere> tiny;
  for (int i = 0; i < 30; ++i) {
    // On whole multiples of 2^-24, which floats hold there.
    const auto coarse = [&] { return static_cast<float>(std::round(random.uniform(-1e3, 1e3))) * 0x1p-20F; };
    tiny.push_back({{coarse(), 3e-6F, coarse()}, 1e-6F});
    b.add(tiny.back());
  }
  const auto scene = b.build();
  std::vector<Ray> rays;
  for (int i = 0; i < effort(1000, 50'000); ++i) {
    const Vec3 c = tiny[random.bits() % tiny.size()].center;
    const Vec3 origin =
        i % 2 ? Vec3{c.x, 1, c.z} : to_float(to_double(c) + random.direction() * random.magnitude(-5, 0));
    rays.push_back({origin, c - origin});
  }
  const auto known = known_rays(scene, rays);
  for (std::size_t i = 1; i < known.size(); i += 2) {
    ASSERT_TRUE(known[i].hit);
    ASSERT_GT(known[i].hit->object, 0U) << "a tiny one, straight from above";
  }
  expect_same_hits_everywhere(scene, known, "tiny beside huge");
}

/// From the surface, from within, and along tangents ± k ulp.
TEST(StressQuadrics, OnInsideAndTangent_Stress31) {
  SceneBuilder b;
  Random random(31);
  std::vector<Sphere> spheres;
  for (int i = 0; i < 20; ++i) {
    spheres.push_back({to_float(random.in_cube() * 5), static_cast<float>(random.magnitude(-2, 0.5))});
    b.add(spheres.back());
  }
  const auto scene = b.build();
  std::vector<Ray> rays;
  for (int i = 0; i < effort(2500, 100'000); ++i) {
    const Sphere& s = spheres[random.bits() % spheres.size()];
    const Vec3d n = random.direction(), c = to_double(s.center), side = cross(n, random.direction());
    switch (i % 4) {
      case 0:
        rays.push_back({to_float(c + n * s.radius), to_float(random.direction())});
        break;
      case 1:
        rays.push_back({to_float(c + n * (s.radius * random.uniform(0, 1))), to_float(random.direction())});
        break;
      default: {
        const double ulps = 1 + random.uniform(-8, 8) * 0x1p-24;
        rays.push_back({to_float(c + n * (s.radius * ulps) - side * random.magnitude(-1, 2)), to_float(side)});
        break;
      }
    }
  }
  const auto known = known_rays(scene, rays);
  EXPECT_GT(count_hits(known), known.size() / 4);
  expect_same_hits_everywhere(scene, known, "tangents");

  // Alone, where the answer is plain: no self-hit outward, the far root inward.
  const auto one = SceneBuilder().add(Sphere{{0, 0, 0}, 1}).build();
  const std::vector<KnownRay> plain{{{{1, 0, 0}, {1, 0, 0}}, {}},         {{{1, 0, 0}, {0, 1, 0}}, {}},
                                    {{{1, 0, 0}, {-1, 0, 0}}, Hit{2}},    {{{0.5F, 0, 0}, {1, 0, 0}}, Hit{0.5F}},
                                    {{{-2, 1, 0}, {1, 0, 0}}, Hit{2}},    {{{-2, 1.0000001F, 0}, {1, 0, 0}}, {}},
                                    {{{0, 0, 0}, {0, 0, -4}}, Hit{0.25F}}};
  expect_same_hits_everywhere(one, plain, "one sphere");
}

TEST(StressQuadrics, RadiiOfNothingAreRefused_Stress32) {
  for (const char* radius : {"0", "-0.0", "-1", "1e-60"}) {
    const std::string number(radius);
    for (const std::string& shape :
         {R"({"type": "sphere", "center": [0, 0, 0], "radius": )" + number + "}",
          R"({"type": "cylinder", "base": [0, 0, 0], "apex": [0, 0, 1], "radius": )" + number + "}",
          R"({"type": "disk", "center": [0, 0, 0], "normal": [0, 0, 1], "radius": )" + number + "}"}) {
      const auto result = proto::parse_scene(R"({"objects": [)" + shape + "]}", proto::NoFiles(), proto::Limits());
      ASSERT_FALSE(result) << shape;
      EXPECT_EQ(result.problem().errors.at(0).pointer, "/objects/0/radius");
    }
  }
}

/// Instances of every shape under a map of scales 10⁴, 1, 10⁻⁴: the same everywhere; normals against long double.
TEST(StressQuadrics, TransformsOfMixedScale_Stress33) {
  for (int seed = 0; seed < effort(6, 200); ++seed) {
    Random random(seed);
    SceneBuilder b;
    for (int i = 0; i < 12; ++i) {
      const Vec3d x = random.direction(), across = cross(x, random.direction()), y = across / length(across),
                  z = cross(x, y);
      std::array<double, 12> rows{};
      for (int r = 0; r < 3; ++r) {
        double* row = rows.data() + r * 4;
        row[0] = x[r] * 1e4, row[1] = y[r], row[2] = z[r] * 1e-4,
        row[3] = random.uniform(-1, 1) * random.magnitude(-2, 4);
      }
      b.place(b.shape(random_shape(random, 1)), 0, placed(rows));
    }
    const auto scene = b.build();
    std::vector<Ray> rays;
    for (int i = 0; i < effort(300, 2000); ++i) {
      const Object& object = scene->objects[random.bits() % scene->objects.size()];
      const Aabb local = bounds(scene->shapes[object.shape]);
      Vec3d p;
      for (int axis = 0; axis < 3; ++axis) p[axis] = random.uniform(local.lo[axis], local.hi[axis]);
      const Vec3d target = object.placement->point_to_world(p);
      const Vec3 origin = to_float(target + random.direction() * random.magnitude(-2, 5));
      rays.push_back({origin, to_float(target - to_double(origin))});
    }
    expect_same_hits_everywhere(scene, known_rays(scene, rays), "mixed scales " + std::to_string(seed));
  }
}

TEST(StressQuadrics, ParallelAndNearlyParallelToLargePlanes_Stress34) {
  SceneBuilder b;
  constexpr float kFar = 1e8F;
  b.add(Quad{{{{-kFar, 0, kFar}, {kFar, 0, kFar}, {kFar, 0, -kFar}, {-kFar, 0, -kFar}}}});
  b.add(Disk{{0, -2, 0}, UnitVec3::y(), kFar}).add(Disk{{0, 50, 0}, *UnitVec3::normalize(Vec3{1e-6F, 1, 0}), 1e5F});
  b.add(Sphere{{3, 0.5F, 0}, 0.5F}).add(Sphere{{1e5F, 1, 10}, 3});
  const auto scene = b.build();
  Random random(34);
  std::vector<Ray> rays;
  for (int i = 0; i < effort(2000, 100'000); ++i) {
    const double slope = i % 4 == 0 ? 0 : random.magnitude(-9, -3) * (i % 2 ? -1 : 1);
    const double turn = random.uniform(0, 7);
    const auto height = i % 8 == 0 ? 0 : random.uniform(-3, 3);
    rays.push_back({to_float({random.uniform(-5, 5), height, random.uniform(-5, 5)}),
                    to_float({std::cos(turn), slope, std::sin(turn)})});
  }
  const auto known = known_rays(scene, rays);
  EXPECT_GT(count_hits(known), known.size() / 3);
  for (const auto& [ray, hit] : known)
    if (hit) {
      ASSERT_TRUE(std::isfinite(hit->t));
    }
  expect_same_hits_everywhere(scene, known, "nearly parallel");
  // A metre above the quad, down by 10⁻⁷ a metre: met 10⁷ metres away, never lost.
  const std::vector<Ray> alone{{{0, 1, 0}, {1, -1e-7F, 0.25F}}, {{0, 1, 0}, {-0.5F, -1e-7F, 0.1F}}};
  const auto ground = SceneBuilder().add(std::get<Quad>(scene->shapes[0])).build();
  const auto far = known_rays(ground, alone);
  for (const KnownRay& k : far) {
    ASSERT_TRUE(k.hit);
    EXPECT_FLOAT_EQ(k.hit->t, 1e7F);
  }
  expect_same_hits_everywhere(ground, far, "ten thousand kilometres");
}

TEST(StressQuadrics, SingularAndMirroredInstances_Stress35) {
  EXPECT_FALSE(Transform::from_rows({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0}));
  EXPECT_FALSE(Transform::from_rows({1, 2, 3, 0, 2, 4, 6, 0, 0, 0, 1, 0}));
  for (int seed = 0; seed < effort(6, 200); ++seed) {
    Random random(seed);
    SceneBuilder b;
    for (int i = 0; i < 12; ++i) {
      const double mirror = i % 2 ? -1 : 1;
      b.place(b.shape(i % 3 ? Shape(Sphere{{}, 1}) : Shape(icosphere(1))), 0,
              placed({mirror * random.uniform(0.5, 2), 0.2, 0, random.uniform(-5, 5), 0, random.uniform(-2, -0.5), 0.3,
                      random.uniform(-5, 5), 0.1, 0, -1, random.uniform(-5, 5)}));
    }
    const auto scene = b.build();
    std::vector<Ray> rays;
    for (int i = 0; i < effort(400, 2000); ++i) {
      const Vec3 origin = to_float(random.direction() * 20);
      rays.push_back({origin, to_float(random.in_cube() * 5) - origin});
    }
    const auto known = known_rays(scene, rays);
    for (const auto& [ray, hit] : known)
      if (hit) {
        const SurfacePoint at = world_surface(*scene, hit->object, hit->primitive, ray, hit->t);
        EXPECT_LT(dot(at.geometric_normal, to_double(ray.direction)), 0) << "outward, so against a ray from outside";
      }
    expect_same_hits_everywhere(scene, known, "mirrored " + std::to_string(seed));
  }
}

}  // namespace
}  // namespace tessera
