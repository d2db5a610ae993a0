#include "core/bounds/convex_hull.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include "core/math/orientation.h"
#include "tests/support/meshes.h"
#include "tests/support/random.h"

namespace tessera {
namespace {

using Points = std::vector<Vec3>;

/// Every edge is run along once in each direction, and the vertices are the faces' corners, each once.
void expect_closed(const ConvexHull& hull) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  std::set<std::uint32_t> corners;
  for (const auto& face : hull.faces)
    for (int i = 0; i < 3; ++i) {
      corners.insert(face[i]);
      EXPECT_TRUE(edges.emplace(face[i], face[(i + 1) % 3]).second) << "an edge of three faces";
    }
  for (const auto& [from, to] : edges) EXPECT_TRUE(edges.contains({to, from})) << "an edge of one face";
  if (hull.dimension < 2) return;
  EXPECT_EQ(corners, std::set(hull.vertices.begin(), hull.vertices.end()));
  EXPECT_EQ(corners.size(), hull.vertices.size());
  EXPECT_EQ(hull.faces.size(), 2 * corners.size() - 4) << "Euler";
}

bool on_a_line(Vec3 a, Vec3 b, Vec3 c) {
  return orientation_along(0, a, b, c) == 0 && orientation_along(1, a, b, c) == 0 && orientation_along(2, a, b, c) == 0;
}

/// No point lies outside of a face, exactly. No face is a line. In a plane, no point lies outside of an edge.
void expect_contains(const ConvexHull& hull, const Points& points) {
  for (const auto& [a, b, c] : hull.faces) {
    EXPECT_FALSE(on_a_line(points[a], points[b], points[c]));
    for (const Vec3 p : points) {
      const int side = orientation(points[a], points[b], points[c], p);
      EXPECT_LE(side, 0);
      EXPECT_TRUE(side == 0 || hull.dimension == 3);
    }
  }
  if (hull.dimension != 2) return;
  const std::size_t n = hull.vertices.size();
  for (std::size_t i = 0; i < n; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const auto side = [&](Vec3 p) {
        return orientation_along(axis, points[hull.vertices[i]], points[hull.vertices[(i + 1) % n]], p);
      };
      const int inside = side(points[hull.vertices[(i + 2) % n]]);
      for (const Vec3 p : points) EXPECT_GE(side(p) * inside, 0);
    }
}

ConvexHull checked_hull(const Points& points) {
  const ConvexHull hull = convex_hull(points);
  expect_closed(hull);
  expect_contains(hull, points);
  return hull;
}

TEST(ConvexHull, OfNothingIsNothing) {
  const ConvexHull hull = convex_hull({});
  EXPECT_EQ(hull.dimension, -1);
  EXPECT_TRUE(hull.vertices.empty());
}

TEST(ConvexHull, OfDuplicatesIsAPoint_Stress36) {
  for (const std::size_t count : {1, 2, 7}) {
    const ConvexHull hull = checked_hull(Points(count, {1, 2, 3}));
    EXPECT_EQ(hull.dimension, 0);
    EXPECT_EQ(hull.vertices.size(), 1);
  }
}

TEST(ConvexHull, OfALineIsItsEnds_Stress36) {
  const ConvexHull hull = checked_hull({{1, 1, 2}, {0, 0, 0}, {3, 3, 6}, {2, 2, 4}, {1, 1, 2}});
  EXPECT_EQ(hull.dimension, 1);
  EXPECT_EQ(std::set(hull.vertices.begin(), hull.vertices.end()), (std::set<std::uint32_t>{1, 2}));
}

TEST(ConvexHull, OfAPlaneIsAPolygonWithTwoSides_Stress36) {
  // A tilted 3×3 grid with its middle doubled: the corners alone decide.
  Points points{{1, 1, 2}};
  for (int x = 0; x < 3; ++x)
    for (int y = 0; y < 3; ++y) points.push_back({float(x), float(y), float(x + y)});
  const ConvexHull hull = checked_hull(points);
  EXPECT_EQ(hull.dimension, 2);
  EXPECT_EQ(hull.vertices.size(), 4);
  EXPECT_EQ(hull.faces.size(), 4);
}

TEST(ConvexHull, OfAGridInACubeIsTheCube_Stress36) {
  Points points;
  for (int x = 0; x < 6; ++x)
    for (int y = 0; y < 6; ++y)
      for (int z = 0; z < 6; ++z) points.push_back({float(x), float(y), float(z)});
  const ConvexHull hull = checked_hull(points);
  EXPECT_EQ(hull.dimension, 3);
  EXPECT_EQ(hull.vertices.size(), 8);
}

TEST(ConvexHull, OfASphereHasEveryPoint_Stress36) {
  const Points points = icosphere(3).positions;
  EXPECT_EQ(checked_hull(points).vertices.size(), points.size());
}

/// Too many to hold each point against each face; Euler's formula and closedness stay.
TEST(ConvexHull, OfALargeSphereIsClosed_Stress36) {
  const Points points = icosphere(6).positions;  // 40,962
  const ConvexHull hull = convex_hull(points);
  expect_closed(hull);
  EXPECT_EQ(hull.vertices.size(), points.size());
}

Points random_points(Random& random) {
  const std::size_t count = 1 + random.bits() % 30;
  const auto kind = random.bits() % 5;
  const double scale = random.bits() % 2 ? 1 : random.magnitude(-44, 37);
  const Vec3d offset = random.bits() % 3 ? Vec3d{} : scale * 1e6 * random.in_cube();
  const Vec3d a = random.in_cube(), b = random.in_cube();
  Points points;
  while (points.size() < count) {
    Vec3d p = random.in_cube();
    if (kind == 0) p = {std::round(p.x), std::round(p.y), std::round(p.z)};
    if (kind == 1) p = p.x * a + p.y * b;
    if (kind == 2) p = p.x * a;
    if (kind == 3) p = random.direction();
    points.push_back(to_float(scale * p + (kind == 4 ? Vec3d{} : offset)));
  }
  return points;
}

TEST(ConvexHull, OfRandomSetsIsClosedAndContainsThem_Stress36) {
  std::array<int, 4> dimensions{};
  for (int seed = 0; seed < 20'000; ++seed) {
    Random random(seed);
    ++dimensions[static_cast<std::size_t>(checked_hull(random_points(random)).dimension)];
    if (HasFailure()) FAIL() << "seed " << seed;
  }
  for (const int times : dimensions) EXPECT_GT(times, 100);
}

}  // namespace
}  // namespace tessera
