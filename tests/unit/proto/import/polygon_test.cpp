#include "proto/import/polygon.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <stop_token>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "tests/unit/proto/import/polygon_checks.h"

namespace tessera::proto {
namespace {

std::vector<TriangleIndices> cut(const std::vector<Vec3>& positions, const Indices& corners) {
  std::vector<TriangleIndices> triangles;
  Steps steps;
  EXPECT_TRUE(triangulate(positions, corners, triangles, steps));
  return triangles;
}

void expect_tiled(const std::vector<Vec3>& positions, double slack = 1e-9) {
  const Indices corners = all_corners(positions.size());
  expect_tiles(positions, corners, cut(positions, corners), slack);
}

TEST(Polygon, ATriangleAndAConvexPolygonAreFansFromTheFirstCorner) {
  const std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  EXPECT_EQ(cut(square, {0, 1, 2}), (std::vector<TriangleIndices>{{0, 1, 2}}));
  EXPECT_EQ(cut(square, {0, 1, 2, 3}), (std::vector<TriangleIndices>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(cut(square, {3, 2, 1, 0}), (std::vector<TriangleIndices>{{3, 2, 1}, {3, 1, 0}}));
}

TEST(Polygon, ADartIsCutAtItsReflexCorner) {
  const std::vector<Vec3> dart{{0, 0, 0}, {2, -2, 0}, {0, 4, 0}, {-2, -2, 0}};
  for (std::uint32_t first = 0; first < 4; ++first) {
    Indices corners = all_corners(4);
    std::rotate(corners.begin(), corners.begin() + first, corners.end());
    expect_tiles(dart, corners, cut(dart, corners));
  }
}

TEST(Polygon, CornersOnALineKeepTheirSides) {
  // A square with three more corners on each side.
  std::vector<Vec3> positions;
  for (int i = 0; i < 4; ++i) positions.push_back({static_cast<float>(i), 0, 7});
  for (int i = 0; i < 4; ++i) positions.push_back({4, static_cast<float>(i), 7});
  for (int i = 0; i < 4; ++i) positions.push_back({4 - static_cast<float>(i), 4, 7});
  for (int i = 0; i < 4; ++i) positions.push_back({0, 4 - static_cast<float>(i), 7});
  expect_tiled(positions);
  for (const TriangleIndices& t : cut(positions, all_corners(16))) {
    EXPECT_GT(length(area_vector(positions, t)), 0) << "a square can be cut without slivers";
  }
}

TEST(Polygon, AHoleReachedByABridge) {
  // Corners 0 and 9, and 4 and 8, are at the same places: the bridge runs there and back.
  expect_tiled(
      {{0, 0, 0}, {8, 0, 0}, {8, 8, 0}, {0, 8, 0}, {0, 0, 0}, {2, 2, 0}, {2, 6, 0}, {6, 6, 0}, {6, 2, 0}, {2, 2, 0}});
}

TEST(Polygon, TwoPartsThatTouchInAPoint) {
  expect_tiled({{0, 0, 0}, {2, -1, 0}, {4, 0, 0}, {2, 1, 0}, {4, 4, 0}, {0, 4, 0}, {2, 1, 0}});
}

TEST(Polygon, ACornerThatRepeatsItsPredecessorIsLeftOut) {
  const std::vector<Vec3> positions{{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0.2F, 0.2F, 0}, {0, 1, 0}, {0, 0, 0}};
  const auto triangles = cut(positions, all_corners(6));
  ASSERT_EQ(triangles.size(), 2U);
  double area = 0;
  for (const TriangleIndices& t : triangles) area += area_vector(positions, t).z;
  EXPECT_DOUBLE_EQ(area, area_vector(positions, all_corners(6)).z);
}

TEST(Polygon, WithoutAreaItStillHasItsTriangles) {
  const std::vector<Vec3> line{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}};
  EXPECT_EQ(cut(line, all_corners(4)).size(), 2U);
  const std::vector<Vec3> point(5, Vec3{1, 2, 3});
  EXPECT_EQ(cut(point, all_corners(5)).size(), 3U);
}

TEST(Polygon, ThatCrossesItselfStillHasItsTriangles) {
  for (int seed = 0; seed < 300; ++seed) {
    std::mt19937 random(seed);
    std::uniform_int_distribution coordinate(0, 6);
    std::vector<Vec3> positions(4 + seed % 40);
    for (Vec3& p : positions) p = {float(coordinate(random)), float(coordinate(random)), 0};
    const Indices corners = all_corners(positions.size());
    Vec3d sum;
    for (const TriangleIndices& t : cut(positions, corners)) sum = sum + area_vector(positions, t);
    EXPECT_EQ(sum, area_vector(positions, corners)) << "seed " << seed;
  }
}

TEST(Polygon, ANonFiniteOrHugeCornerIsRefused) {
  for (const float bad : {std::nanf(""), INFINITY, 1e30F}) {
    const std::vector<Vec3> positions{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, bad, 0}};
    std::vector<TriangleIndices> triangles;
    Steps steps;
    EXPECT_FALSE(triangulate(positions, all_corners(4), triangles, steps));
    EXPECT_TRUE(triangles.empty());
  }
}

Vec3 at(double angle, double radius) { return to_float(Vec3d{radius * std::cos(angle), radius * std::sin(angle), 0}); }

/// A band of constant width around the origin, `turns` times.
std::vector<Vec3> spiral(std::size_t corners, double turns) {
  const std::size_t half = corners / 2;
  std::vector<Vec3> positions(2 * half);
  for (std::size_t i = 0; i < half; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(half);
    const double angle = 2 * std::numbers::pi * turns * share;
    positions[i] = at(angle, 1 + turns * share);
    positions[2 * half - 1 - i] = at(angle, 0.6 + turns * share);
  }
  return positions;
}

/// Teeth that are cut off a bar: concave everywhere, never a fan.
std::vector<Vec3> comb(std::size_t corners) {
  const std::size_t teeth = corners / 2 - 1;
  std::vector<Vec3> positions{{0, -1, 0}, {2 * static_cast<float>(teeth), -1, 0}};
  for (std::size_t i = teeth; i > 0; --i) {
    positions.push_back({2 * static_cast<float>(i), 1, 0});
    positions.push_back({2 * static_cast<float>(i) - 1, 0, 0});
  }
  return positions;
}

std::vector<Vec3> star(std::size_t corners) {
  std::vector<Vec3> positions(corners);
  for (std::size_t i = 0; i < corners; ++i) {
    positions[i] = at(2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(corners), i % 2 ? 1 : 100);
  }
  return positions;
}

/// Of any radius: most diagonals are long.
std::vector<Vec3> random_star(std::size_t corners) {
  std::mt19937 random(7);
  std::uniform_real_distribution radius(0.05, 1.0);
  std::vector<Vec3> positions(corners);
  for (std::size_t i = 0; i < corners; ++i) {
    positions[i] = at(2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(corners), radius(random));
  }
  return positions;
}

/// All corners but one lie on a line.
std::vector<Vec3> line(std::size_t corners) {
  std::vector<Vec3> positions;
  for (std::size_t i = 1; i < corners; ++i) positions.push_back({static_cast<float>(i), 0, 0});
  positions.push_back({-1, 1, 0});
  return positions;
}

struct Large {
  const char* name;
  std::vector<Vec3> (*make)(std::size_t corners);
};
/// Petals that all meet in one point.
std::vector<Vec3> flower(std::size_t corners) {
  std::vector<Vec3> positions;
  const auto petals = static_cast<double>(corners / 3);
  for (double i = 0; i < petals; ++i) {
    const auto at = [&](double part) {
      const double angle = 2 * std::numbers::pi * (i + part) / petals;
      return Vec3{static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0};
    };
    positions.insert(positions.end(), {Vec3{}, at(0.1), at(0.6)});
  }
  return positions;
}

constexpr Large kLarge[]{
    {"spiral", [](std::size_t n) { return spiral(n, 10); }},
    {"narrow spiral", [](std::size_t n) { return spiral(n, std::pow(static_cast<double>(n), 2.0 / 3) / 6); }},
    {"comb", comb},
    {"star", star},
    {"random star", random_star},
    {"line", line}};

TEST(Polygon, LargeOnesAreTiled) {
  for (const Large& shape : kLarge) {
    SCOPED_TRACE(shape.name);
    expect_tiled(shape.make(20'000));
  }
}

/// A step is a corner that is asked, or a box of corners that is looked into. Looking at every other corner for every
/// ear would take more than 10^9 of them, and 10^12.
TEST(Polygon, LargeOnesTakeStepsNearTheirNumberOfCorners) {
  for (const Large& shape : kLarge) {
    SCOPED_TRACE(shape.name);
    for (const auto& [corners, most] : {std::pair<std::size_t, std::uint64_t>{4096, 200}, {100'000, 600}}) {
      const std::vector<Vec3> positions = shape.make(corners);
      std::vector<TriangleIndices> triangles;
      Steps steps;
      ASSERT_TRUE(triangulate(positions, all_corners(positions.size()), triangles, steps));
      EXPECT_EQ(triangles.size(), positions.size() - 2);
      EXPECT_LE(steps.taken(), most * corners);
    }
  }
  const std::vector<Vec3> million = spiral(1'000'000, 1500);
  std::vector<TriangleIndices> triangles;
  Steps steps;
  ASSERT_TRUE(triangulate(million, all_corners(million.size()), triangles, steps));
  EXPECT_EQ(triangles.size(), million.size() - 2);
  EXPECT_LE(steps.taken(), 600U * 1'000'000);
}

TEST(Polygon, LargeOnesThatComeToTheSamePointsAgainTakeFewStepsToo) {
  std::vector<Vec3> rounds;
  for (int i = 0; i < 10'000; ++i) rounds.insert(rounds.end(), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  for (const std::vector<Vec3>& positions : {flower(30'000), rounds}) {
    std::vector<TriangleIndices> triangles;
    Steps steps;
    ASSERT_TRUE(triangulate(positions, all_corners(positions.size()), triangles, steps));
    EXPECT_EQ(triangles.size(), positions.size() - 2);
    EXPECT_LE(steps.taken(), 600 * positions.size());
  }
}

TEST(Polygon, LargeOnesThatCrossThemselvesTakeFewStepsToo) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> anywhere(0, 1);
  std::vector<Vec3> positions(100'000);
  for (Vec3& p : positions) p = {anywhere(random), anywhere(random), 0};
  std::vector<TriangleIndices> triangles;
  Steps steps;
  ASSERT_TRUE(triangulate(positions, all_corners(positions.size()), triangles, steps));
  EXPECT_EQ(triangles.size(), positions.size() - 2);
  EXPECT_LE(steps.taken(), 600U * 100'000);
}

TEST(Polygon, StopsWhenNobodyWantsIt) {
  std::stop_source stop;
  stop.request_stop();
  Steps steps(stop.get_token());
  const std::vector<Vec3> positions = comb(100'000);
  std::vector<TriangleIndices> triangles;
  EXPECT_THROW(triangulate(positions, all_corners(positions.size()), triangles, steps), Abandoned);
}

TEST(Polygon, RandomStarShapedOnesAreTiledInAnyPlane) {
  for (int seed = 0; seed < 2000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution unit(0.0, 1.0);
    const std::size_t n = 3 + random() % (seed % 50 == 0 ? 500 : 40);
    // On a plane along two axes whose image is exact, so that the polygon stays simple and flat.
    const int plane = static_cast<int>(random() % 3);
    const bool mirrored = random() % 2 != 0;
    std::vector<Vec3> positions(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * (static_cast<double>(i) + 0.8 * unit(random)) / double(n);
      const double radius = 0.05 + unit(random);
      Vec3 p;
      p[plane] = 3;
      p[(plane + 1) % 3] = static_cast<float>(radius * std::cos(angle));
      p[(plane + 2) % 3] = static_cast<float>((mirrored ? -1 : 1) * radius * std::sin(angle));
      positions[i] = p;
    }
    Indices corners = all_corners(n);
    std::rotate(corners.begin(), corners.begin() + random() % n, corners.end());
    expect_tiles(positions, corners, cut(positions, corners));
  }
}

TEST(Polygon, RandomOnesOnAGridAreTiledThoughManyCornersLieOnLines) {
  // Histograms: simple, concave, full of corners on lines and of equal heights.
  for (int seed = 0; seed < 1000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const int columns = 1 + static_cast<int>(random() % 12);
    std::vector<Vec3> positions;
    for (int x = 0; x <= columns; ++x) positions.push_back({float(x), 0, 0});
    for (int x = columns; x > 0; --x) {
      const auto height = static_cast<float>(1 + random() % 3);
      positions.push_back({float(x), height, 0});
      positions.push_back({float(x) - 0.5F, height, 0});
      positions.push_back({float(x) - 1, height, 0});
    }
    positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
    expect_tiled(positions);
  }
}

}  // namespace
}  // namespace tessera::proto
