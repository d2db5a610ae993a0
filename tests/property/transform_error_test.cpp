#include <gtest/gtest.h>

#include "core/math/transform.h"
#include "tests/support/random.h"
#include "tests/support/wide.h"

namespace tessera {
namespace {

/// Rotations, shears and mirrors with scales 1e-3 … 1e3 per axis and moves of 1e-3 … 1e6.
std::array<double, 12> random_rows(Random& random) {
  const Vec3d scale{random.magnitude(-3, 3), random.magnitude(-3, 3), random.magnitude(-3, 3)};
  const Vec3d move = random.magnitude(-3, 6) * random.in_cube();
  std::array<double, 12> rows{};
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3d row = random.in_cube();
    for (int j = 0; j < 3; ++j) rows[i * 4 + static_cast<std::size_t>(j)] = row[j] * scale[j];
    rows[i * 4 + 3] = move[static_cast<int>(i)];
  }
  return rows;
}

Vec3w apply(const std::array<double, 12>& rows, Vec3w p) {
  Vec3w out;
  for (int i = 0; i < 3; ++i) {
    const double* row = rows.data() + i * 4;
    out[i] = row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3];
  }
  return out;
}

/// The point at t on the local ray, brought back to the world exactly, is off the world ray by what
/// `Transform::error` allows.
TEST(TransformError, LocalRaysStayWithinTheStatedError) {
  Wide worst = 0;
  int transforms = 0;
  for (int seed = 0; seed < 20'000; ++seed) {
    Random random(seed);
    const auto placement = Transform::from_rows(random_rows(random));
    if (!placement) continue;
    ++transforms;
    const Transform::Error error = placement->error();
    const auto rows = placement->rows();
    for (int i = 0; i < 10; ++i) {
      const Ray world{to_float(random.magnitude(-3, 6) * random.in_cube()), to_float(random.in_cube())};
      const auto t = static_cast<float>(random.magnitude(-3, 6));
      const Vec3w back = apply(rows, point_at(placement->to_local(world), t));
      const Wide off = max_component(abs(back - point_at(world, t)));
      const Wide o = max_component(abs(world.origin));
      const Wide r = max_component(abs(widen(world.direction))) * t;
      const Wide allowed = 8 * kUnitRoundoff * (error.condition * (o + r) + error.offset);
      ASSERT_LE(off, allowed) << "seed " << seed << " ray " << i;
      worst = std::max(worst, off / allowed);
    }
  }
  EXPECT_GT(transforms, 19'000);
  EXPECT_GT(worst, 0.05) << "the bound is far from what happens";
}

TEST(TransformError, OriginsStayWithinTheErrorOfTheirAxes) {
  Wide worst = 0;
  for (int seed = 0; seed < 20'000; ++seed) {
    Random random(seed);
    const auto placement = Transform::from_rows(random_rows(random));
    if (!placement) continue;
    const auto rows = placement->rows();
    for (int i = 0; i < 10; ++i) {
      Vec3 origin;
      for (int axis = 0; axis < 3; ++axis)
        origin[axis] = static_cast<float>(random.magnitude(-3, 9) * random.uniform(-1, 1));
      const Vec3d allowed = placement->origin_error(to_double(origin), placement->to_world());
      const Vec3w back = apply(rows, widen(placement->to_local({origin, {0, 0, 1}}).origin));
      for (int axis = 0; axis < 3; ++axis) {
        const Wide off = std::abs(back[axis] - origin[axis]);
        ASSERT_LE(off, allowed[axis]) << "seed " << seed << " ray " << i;
        worst = std::max(worst, off / allowed[axis]);
      }
    }
  }
  EXPECT_GT(worst, 0.05) << "the bound is far from what happens";
}

TEST(TransformError, PointsAndTheWayBackAgree) {
  for (int seed = 0; seed < 20'000; ++seed) {
    Random random(seed);
    const auto placement = Transform::from_rows(random_rows(random));
    if (!placement) continue;
    const auto rows = placement->rows();
    const Vec3d local = random.magnitude(-3, 3) * random.in_cube();
    const Vec3w off = widen(placement->point_to_world(local)) - apply(rows, widen(local));
    Wide size = 0;
    for (std::size_t i = 0; i < 12; ++i)
      size = std::max(size, std::abs(static_cast<Wide>(rows[i])) * (i % 4 == 3 ? 1 : max_component(abs(widen(local)))));
    EXPECT_LE(max_component(abs(off)), 0x1p-49L * size) << "seed " << seed;
  }
}

}  // namespace
}  // namespace tessera
