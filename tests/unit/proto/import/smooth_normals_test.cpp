#include "proto/import/smooth_normals.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

namespace tessera::proto {
namespace {

void smooth(TriangleMesh& mesh, float degrees) {
  TriangleMesh* const meshes[] = {&mesh};
  Steps steps;
  smooth_normals(meshes, degrees, steps);
}

void expect_near(Vec3 actual, Vec3 expected, double slack = 1e-6) {
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(actual[axis], expected[axis], slack);
}

TriangleMesh cube() {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions.push_back({i & 1 ? 1.0F : -1.0F, i & 2 ? 1.0F : -1.0F, i & 4 ? 1.0F : -1.0F});
  // Each side cut along one of its diagonals, so that corners have one or two triangles of it.
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

TEST(SmoothNormals, EdgesThatBendByMoreStaySharp) {
  TriangleMesh sharp = cube();
  smooth(sharp, 89.9F);
  EXPECT_EQ(sharp.positions.size(), 24U) << "three at each corner";
  ASSERT_EQ(sharp.normals.size(), 24U);
  for (const TriangleIndices& t : sharp.triangles) {
    EXPECT_EQ(sharp.normals[t[0]], sharp.normals[t[1]]);
    EXPECT_EQ(sharp.normals[t[0]], sharp.normals[t[2]]);
    const Vec3d area = cross(to_double(sharp.positions[t[1]]) - to_double(sharp.positions[t[0]]),
                             to_double(sharp.positions[t[2]]) - to_double(sharp.positions[t[0]]));
    EXPECT_NEAR(dot(area, to_double(sharp.normals[t[0]])), 4, 1e-6);
  }
  TriangleMesh round = cube();
  smooth(round, 90);
  EXPECT_EQ(round.positions, cube().positions) << "90 isn't more than 90";
  EXPECT_EQ(round.triangles, cube().triangles);
  const float third = 1 / std::sqrt(3.0F);
  for (std::size_t i = 0; i < 8; ++i) expect_near(round.normals[i], round.positions[i] * third);
}

TEST(SmoothNormals, WeighByAngles) {
  // A roof whose faces meet at the origin with angles of 90 and 45 degrees.
  TriangleMesh mesh{{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 1}}, {{0, 1, 2}, {0, 3, 1}}, {}, {}};
  smooth(mesh, 180);
  const double length = std::sqrt(90.0 * 90 + 45 * 45);
  expect_near(mesh.normals[0], {static_cast<float>(45 / length), static_cast<float>(90 / length), 0});
  expect_near(mesh.normals[2], {0, 1, 0});
}

TEST(SmoothNormals, AreThoseOfASphereOnASphere) {
  TriangleMesh mesh;
  constexpr int kRings = 24, kSides = 48;
  for (int r = 0; r <= kRings; ++r)
    for (int s = 0; s <= kSides; ++s) {  // with a seam, where positions are alike
      const double a = std::numbers::pi * r / kRings, b = 2 * std::numbers::pi * (s % kSides) / kSides;
      mesh.positions.push_back({static_cast<float>(std::sin(a) * std::cos(b)),
                                static_cast<float>(std::sin(a) * std::sin(b)),
                                static_cast<float>(r == 0        ? 1
                                                   : r == kRings ? -1
                                                                 : std::cos(a))});
      if (r == 0 || r == kRings) mesh.positions.back().x = mesh.positions.back().y = 0;
    }
  const auto at = [](int r, int s) { return static_cast<std::uint32_t>(r * (kSides + 1) + s); };
  for (int r = 0; r < kRings; ++r)
    for (int s = 0; s < kSides; ++s) {
      if (r > 0) mesh.triangles.push_back({at(r, s), at(r + 1, s), at(r, s + 1)});
      if (r < kRings - 1) mesh.triangles.push_back({at(r, s + 1), at(r + 1, s), at(r + 1, s + 1)});
    }
  const std::size_t before = mesh.positions.size();
  smooth(mesh, 30);
  EXPECT_EQ(mesh.positions.size(), before);
  for (const TriangleIndices& t : mesh.triangles)
    for (const std::uint32_t i : t) expect_near(mesh.normals[i], mesh.positions[i], 0.01);
}

TEST(SmoothNormals, GoRoundAVertexOverSmoothEdgesAlone) {
  // A fan of three around the origin: the outer two are bent by 60 degrees, each pair by 30.
  const float c = std::cos(std::numbers::pi_v<float> / 6), s = std::sin(std::numbers::pi_v<float> / 6);
  TriangleMesh fan{
      {{0, 0, 0}, {1, -1, 0}, {1, 1, 0}, {0, 1 + c, s}, {0, -1 - c, s}}, {{0, 1, 2}, {0, 2, 3}, {0, 4, 1}}, {}, {}};
  TriangleMesh joined = fan;
  smooth(joined, 60);
  EXPECT_EQ(joined.positions.size(), 5U);
  smooth(fan, 1);
  EXPECT_EQ(fan.positions.size(), 9U) << "three at the origin, two at each end of a sharp edge";
}

TEST(SmoothNormals, DoNotAskWhatMeshAVertexBelongsTo) {
  TriangleMesh whole = cube(), top, rest;
  smooth(whole, 90);
  top.positions = rest.positions = cube().positions;
  top.triangles = {cube().triangles[2], cube().triangles[3]};
  rest.triangles = cube().triangles;
  rest.triangles.erase(rest.triangles.begin() + 2, rest.triangles.begin() + 4);
  TriangleMesh* const both[] = {&top, &rest};
  Steps steps;
  smooth_normals(both, 90, steps);
  for (const TriangleMesh* mesh : both)
    for (const TriangleIndices& t : mesh->triangles)
      for (const std::uint32_t i : t) EXPECT_EQ(mesh->normals[i], whole.normals[i]);
  EXPECT_EQ(top.normals[0], (Vec3{0, 0, 1})) << "of no triangle: any";
}

TEST(SmoothNormals, KeepWhatVerticesHave) {
  TriangleMesh mesh = cube();
  MeshAttributes attributes;
  for (const Vec3 p : mesh.positions) {
    attributes.uvs[0].push_back({p.x, p.y});
    attributes.colors.push_back({p.x, p.y, p.z, 1});
  }
  mesh.attributes = std::make_shared<const MeshAttributes>(attributes);
  smooth(mesh, 30);
  ASSERT_EQ(mesh.attributes->uvs[0].size(), 24U);
  ASSERT_EQ(mesh.attributes->colors.size(), 24U);
  EXPECT_TRUE(mesh.attributes->uvs[1].empty());
  EXPECT_TRUE(mesh.attributes->tangents.empty());
  for (std::size_t i = 0; i < 24; ++i) {
    EXPECT_EQ(mesh.attributes->uvs[0][i], (Vec2{mesh.positions[i].x, mesh.positions[i].y}));
    EXPECT_EQ(mesh.attributes->colors[i][2], mesh.positions[i].z);
  }
}

TEST(SmoothNormals, BothSidesOfASheetHaveTheirOwn) {
  TriangleMesh sheet{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}, {}, {}};
  smooth(sheet, 180);
  for (const TriangleIndices& t : sheet.triangles) {
    const float z = t == sheet.triangles[0] ? 1 : -1;
    for (const std::uint32_t i : t) EXPECT_EQ(sheet.normals[i], (Vec3{0, 0, z}));
  }
}

TEST(SmoothNormals, EdgesOfMoreThanTwoTrianglesAreSharp) {
  TriangleMesh three{
      {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 0.1F, 0}, {-1, -0.1F, 0}}, {{0, 1, 2}, {1, 0, 3}, {1, 0, 4}}, {}, {}};
  smooth(three, 30);
  EXPECT_EQ(three.positions.size(), 9U);
}

TEST(SmoothNormals, OfTrianglesWithoutAreaAndOfNothing) {
  TriangleMesh line{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 1, 3}}, {}, {}};
  smooth(line, 30);
  for (const Vec3 n : line.normals) EXPECT_NEAR(length(to_double(n)), 1, 1e-6);
  const TriangleIndices& seen = line.triangles[1];
  for (const std::uint32_t i : seen) EXPECT_EQ(line.normals[i], (Vec3{0, 0, 1}));
  TriangleMesh nothing;
  smooth(nothing, 30);
  EXPECT_TRUE(nothing.normals.empty());
}

TEST(SmoothNormals, AreAbandonedSoon) {
  std::stop_source stop;
  stop.request_stop();
  TriangleMesh mesh;
  mesh.positions.resize(10'000);
  TriangleMesh* const meshes[] = {&mesh};
  Steps steps(stop.get_token());
  EXPECT_THROW(smooth_normals(meshes, 30, steps), Abandoned);
}

}  // namespace
}  // namespace tessera::proto
