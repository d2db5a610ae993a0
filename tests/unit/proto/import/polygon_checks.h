#pragma once

#include <cmath>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "proto/import/polygon.h"

namespace tessera::proto {

using Indices = std::vector<std::uint32_t>;

inline Indices all_corners(std::size_t n) {
  Indices corners(n);
  std::iota(corners.begin(), corners.end(), 0U);
  return corners;
}

/// That the triangles tile the polygon: its sides occur once each, inner edges once in both directions, and no
/// triangle is turned over, so that the areas add up.
inline void expect_tiles(const std::vector<Vec3>& positions, const Indices& corners,
                         const std::vector<TriangleIndices>& triangles, double slack = 1e-9) {
  ASSERT_EQ(triangles.size(), corners.size() - 2);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  const Vec3d whole = area_vector(positions, corners);
  const double area = length(whole);
  double sum = 0;
  for (const TriangleIndices& t : triangles) {
    for (int i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
    const double part = dot(area_vector(positions, t), whole) / area;
    EXPECT_GE(part, -slack * area);
    sum += std::abs(part);
  }
  EXPECT_NEAR(sum, area, slack * area);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::pair side{corners[i], corners[(i + 1) % corners.size()]};
    EXPECT_EQ(edges[side], 1) << side.first << "-" << side.second;
    edges.erase(side);
  }
  for (const auto& [edge, times] : edges) {
    EXPECT_EQ(times, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first})) << edge.first << "-" << edge.second;
  }
}

}  // namespace tessera::proto
