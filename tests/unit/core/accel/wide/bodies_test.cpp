#include "core/accel/wide/bodies.h"

#include <gtest/gtest.h>

#include "core/accel/wide/wide_accel.h"
#include "tests/support/same_hits.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

TriangleMesh ball_at(float x) { return icosphere(1, 1, {x, 0, 0}); }

/// Balls in a row whose boxes are in each other's way.
SceneBuilder row_of_balls(int count) {
  SceneBuilder b;
  for (int i = 0; i < count; ++i) b.add(ball_at(0.5F * static_cast<float>(i)));
  return b;
}

std::vector<std::uint32_t> counts(const Bodies& bodies) {
  std::vector<std::uint32_t> counts;
  for (std::uint32_t body = 0; body < bodies.size(); ++body) counts.push_back(bodies[body].count);
  return counts;
}

TEST(Bodies, JoinMeshesThatFollowEachOther) {
  SceneBuilder b = row_of_balls(3);
  b.add(Sphere{{0, 0, 0}, 1});
  for (const float x : {0.0F, 0.5F}) b.add(ball_at(x));
  b.place(b.shape(ball_at(0)), 0, placed({2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0})).add(TriangleMesh{}).add(ball_at(0));
  const auto scene = b.build();
  EXPECT_EQ(counts(Bodies::joined(scene)), (std::vector<std::uint32_t>{3, 1, 2, 1, 1, 1}));
  EXPECT_TRUE(Bodies::joined(scene).are_joined());
  EXPECT_EQ(counts(Bodies::apart(scene)), std::vector<std::uint32_t>(9, 1));
  EXPECT_FALSE(Bodies::apart(scene).are_joined());
}

TEST(Bodies, JoinQuadsAsTwoTriangles) {
  const Quad wall{{{{-2, -2, 0}, {2, -2, 0}, {2, 2, 0.5F}, {-2, 2, 0}}}};  // not flat
  const Quad broken{{{{-2, -2, 0}, {2, -2, 0}, {2, -2, 0}, {-2, 2, 0}}}};
  SceneBuilder b;
  const auto scene = b.add(ball_at(0)).add(wall).add(ball_at(0.5F)).add(broken).add(wall).build();
  const Bodies bodies = Bodies::joined(scene);
  ASSERT_EQ(counts(bodies), (std::vector<std::uint32_t>{3, 1, 1}));
  const std::uint32_t first = primitive_count(scene->shapes[0]);
  for (const std::uint32_t half : {0U, 1U}) {
    EXPECT_EQ(bodies.of_object({0, first + half}).object, 1U);
    EXPECT_EQ(bodies.of_object({0, first + half}).primitive, 0U);
  }
  EXPECT_EQ(bodies.of_object({0, first + 2}).object, 2U);
  EXPECT_EQ(bodies.left({1, 0}).object, kNoPrimitive.object);
  EXPECT_EQ(bodies.left({2, 5}).primitive, first + 7);
  EXPECT_EQ(bodies.left({4, 0}).object, 2U) << "one that stays alone";
}

TEST(Bodies, LeaveInstances) {
  SceneBuilder b;
  const std::uint32_t ball = b.shape(ball_at(0));
  b.place(ball).add(ball_at(0.5F)).place(ball).add(ball_at(0.2F)).add(ball_at(0.3F));
  EXPECT_EQ(counts(Bodies::joined(b.build())), (std::vector<std::uint32_t>{1, 1, 1, 2}));
}

TEST(Bodies, LeaveMeshesThatLieApart) {
  SceneBuilder b;
  for (const float x : {0.0F, 9.0F, 18.0F}) b.add(ball_at(x));
  EXPECT_FALSE(Bodies::joined(b.build()).are_joined());
  // A wall around all of them is in each one's way.
  SceneBuilder room;
  room.add(icosphere(1, 30)).add(ball_at(0)).add(ball_at(9)).add(ball_at(18));
  EXPECT_EQ(counts(Bodies::joined(room.build())), std::vector<std::uint32_t>{4});
}

TEST(Bodies, JoinSmallMeshesThatAreMany) {
  SceneBuilder b;
  for (int i = 0; i < 66; ++i) b.add(ball_at(9.0F * static_cast<float>(i)));
  EXPECT_EQ(counts(Bodies::joined(b.build())), std::vector<std::uint32_t>{66});
  // A large one stays alone, and so do the few behind it.
  TriangleMesh large = ball_at(-9);
  large.triangles.resize(5000, large.triangles[0]);
  SceneBuilder m;
  for (int i = 0; i < 66; ++i) m.add(ball_at(9.0F * static_cast<float>(i)));
  m.add(large).add(ball_at(-18)).add(ball_at(-27));
  EXPECT_EQ(counts(Bodies::joined(m.build())), (std::vector<std::uint32_t>{66, 1, 1, 1}));
}

TEST(Bodies, JoinNoMoreThanAMeshHasRoomFor) {
  TriangleMesh half = ball_at(0);
  half.triangles.resize(501, half.triangles[0]);
  SceneBuilder b;
  b.add(half).add(half).add(ball_at(0));
  EXPECT_EQ(counts(Bodies::joined(b.build(), 1000)), (std::vector<std::uint32_t>{1, 2}));
  TriangleMesh scattered = ball_at(0);
  scattered.positions.resize(3000);
  SceneBuilder s;
  s.add(scattered).add(ball_at(0.5F)).add(ball_at(0));
  EXPECT_EQ(counts(Bodies::joined(s.build(), 1000)), (std::vector<std::uint32_t>{1, 2}));
}

TEST(Bodies, KnowTheirPrimitivesByBothNames) {
  SceneBuilder b;
  b.add(Sphere{{0, 0, 0}, 1});
  const auto scene = b.add(ball_at(0)).add(icosphere(0)).add(ball_at(0.5F)).build();
  const Bodies bodies = Bodies::joined(scene);
  ASSERT_EQ(counts(bodies), (std::vector<std::uint32_t>{1, 3}));
  std::uint32_t expected = 0;
  for (std::uint32_t object = 1; object < 4; ++object) {
    const std::uint32_t primitives = primitive_count(scene->shapes[scene->objects[object].shape]);
    for (std::uint32_t primitive = 0; primitive < primitives; ++primitive, ++expected) {
      const PrimitiveId id = bodies.left({object, primitive});
      EXPECT_EQ(id.object, 1U);
      EXPECT_EQ(id.primitive, expected);
      EXPECT_EQ(bodies.of_object(id).object, object);
      EXPECT_EQ(bodies.of_object(id).primitive, primitive);
      const TriangleMesh joined = bodies.joined_mesh(bodies[1]);
      const auto& own = std::get<TriangleMesh>(scene->shapes[scene->objects[object].shape]);
      for (std::size_t corner = 0; corner < 3; ++corner)
        EXPECT_EQ(joined.positions[joined.triangles[expected][corner]],
                  own.positions[own.triangles[primitive][corner]]);
    }
  }
  EXPECT_EQ(bodies.left(kNoPrimitive).object, kNoPrimitive.object);
  EXPECT_EQ(bodies.first_of(3).primitive, expected - primitive_count(scene->shapes[scene->objects[3].shape]));
  EXPECT_EQ(bodies.of_objects(std::vector<std::uint32_t>{0, 2, 3}), (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(bodies.of_objects(std::vector<std::uint32_t>{3}), std::vector<std::uint32_t>{1});
  ObjectMarks marks(4);
  bodies.mark(marks, 1);
  EXPECT_EQ(marks.unmarked(), 1U);
}

/// Balls of which some are the same, with spheres and instances among them: hits coincide, within a joined mesh and
/// with what isn't.
std::shared_ptr<const Scene> coincident_scene() {
  const Quad wall{{{{-2, -2, 0}, {2, -2, 0}, {2, 2, 0.5F}, {-2, 2, 0}}}};  // not flat
  const TriangleMesh ball = ball_at(0), other = ball_at(0.5F);
  SceneBuilder b;
  b.add(wall).add(wall).add(ball).add(other).add(wall).add(ball).add(Sphere{{0, 0, 0}, 0.9F}).add(other).add(ball);
  b.place(b.shape(ball), 0, placed({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0})).add(other).add(other);
  return b.build();
}

std::vector<Ray> rays_about(std::size_t count) {
  Random random(5);
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3d from = random.direction() * 3;
    rays.push_back({to_float(from), to_float(random.in_cube() - from)});
  }
  return rays;
}

TEST(JoinedAccel, FindsWhatBruteForceFinds) {
  const auto scene = coincident_scene();
  ASSERT_TRUE(Bodies::joined(scene).are_joined());
  const auto known = known_rays(scene, rays_about(2000));
  ASSERT_GT(count_hits(known), 500U);
  for (const WideKernels* kernels : runnable_wide_kernels()) {
    const auto accel = make_wide(scene, {AccelKind::wide}, *kernels, WideAccel::build_tree);
    expect_same_hits(*accel, known, kernels->name);
    const std::vector<std::uint32_t> some{1, 4, 6, 9, 10};
    for (const auto& [ray, hit] : known) {
      if (!hit || std::ranges::find(some, hit->object) == some.end()) continue;
      EXPECT_EQ(accel->closest_among(ray, some, {}), hit);
    }
  }
}

TEST(JoinedAccel, TellsCoincidentSurfacesApart) {
  const auto scene = coincident_scene();
  const auto brute = make_accel(scene, {AccelKind::brute}), accel = make_accel(scene, {AccelKind::wide});
  std::size_t layers = 0;
  for (const Ray& ray : rays_about(2000))
    for (auto hit = brute->closest(ray); hit; ++layers) {
      const auto next = brute->coincident(ray, *hit);
      ASSERT_EQ(accel->coincident(ray, *hit), next);
      hit = next;
    }
  EXPECT_GT(layers, 2000U);
}

/// Rays leave triangles of joined meshes, as an integrator's do: what they leave is never met, all else is.
TEST(JoinedAccel, KnowsWhatRaysLeave) {
  const auto scene = coincident_scene();
  const auto brute = make_accel(scene, {AccelKind::brute}), accel = make_accel(scene, {AccelKind::wide});
  std::vector<Ray> away;
  for (const Ray& ray : rays_about(2000))
    if (const auto hit = brute->closest(ray); hit && !scene->objects[hit->object].placement) {
      const auto* mesh = std::get_if<TriangleMesh>(&scene->shapes[scene->objects[hit->object].shape]);
      if (!mesh) continue;
      // Strictly beside the triangle, running away from it; through its own twins it may.
      const TriangleIndices& t = mesh->triangles[hit->primitive];
      const Vec3 normal =
          cross(mesh->positions[t[1]] - mesh->positions[t[0]], mesh->positions[t[2]] - mesh->positions[t[0]]);
      const float side = dot(normal, ray.direction) > 0 ? 1.0F : -1.0F;
      away.push_back({ray.origin + ray.direction * hit->t + normal * (side * 1e-3F),
                      normal * side,
                      0,
                      kInfinity,
                      {hit->object, hit->primitive}});
    }
  ASSERT_GT(away.size(), 500U);
  std::vector<Hit> hits(away.size());
  std::vector<std::uint8_t> hidden(away.size());
  accel->closest(away, hits);
  accel->occluded(away, hidden);
  std::size_t met = 0;
  for (std::size_t i = 0; i < away.size(); ++i) {
    EXPECT_EQ(hits[i], brute->closest(away[i]).value_or(Hit{}));
    EXPECT_EQ(hidden[i] != 0, hits[i].t < kInfinity);
    met += hidden[i];
  }
  EXPECT_GT(met, 50U);
}

}  // namespace
}  // namespace tessera
