#include <gtest/gtest.h>

#include "core/math/transform.h"
#include "core/math/unit_vec3.h"
#include "tests/support/random.h"
#include "tests/support/wide.h"

namespace tessera {
namespace {

struct Frame {
  Vec3d x, y, z;
};

Frame random_frame(Random& random) {
  const Vec3d x = random.direction();
  const Vec3d across = cross(x, random.direction());
  const Vec3d y = across / length(across);
  return {x, y, cross(x, y)};
}

/// Scales along the local axes, then turns into `frame`.
std::array<double, 12> rows_of(const Frame& f, Vec3d scale, Vec3d move) {
  std::array<double, 12> rows{};
  for (int i = 0; i < 3; ++i) {
    double* row = rows.data() + i * 4;
    row[0] = f.x[i] * scale.x, row[1] = f.y[i] * scale.y, row[2] = f.z[i] * scale.z, row[3] = move[i];
  }
  return rows;
}

Wide angle_between(Vec3w a, Vec3w b) {
  const Vec3w c = cross(a, b);
  return std::atan2(std::sqrt(dot(c, c)), dot(a, b));
}

/// A sphere under that map is an ellipsoid whose normal is known in closed form: the frame's axes weighed by n / scale.
void expect_outward_normals(Vec3d scale) {
  for (int seed = 0; seed < 100'000; ++seed) {
    Random random(seed);
    const Frame frame = random_frame(random);
    const auto placement = Transform::from_rows(rows_of(frame, scale, random.magnitude(-3, 3) * random.in_cube()));
    ASSERT_TRUE(placement) << "seed " << seed;
    const Vec3d n = random.direction();
    const Vec3w exact = widen(frame.x) * (n.x / static_cast<Wide>(scale.x)) +
                        widen(frame.y) * (n.y / static_cast<Wide>(scale.y)) +
                        widen(frame.z) * (n.z / static_cast<Wide>(scale.z));
    EXPECT_LE(angle_between(widen(placement->normal_to_world(n)), exact), 1e-4L) << "seed " << seed;
  }
}

TEST(TransformNormals, Stress33_MixedScale) { expect_outward_normals({1e4, 1, 1e-4}); }

TEST(TransformNormals, Stress35_MirroringKeepsNormalsOutward) {
  expect_outward_normals({-1, 1, 1});
  expect_outward_normals({2, -3, 0.5});
  expect_outward_normals({-1, -1, -1});
  expect_outward_normals({1e4, 1, -1e-4});
}

}  // namespace
}  // namespace tessera
