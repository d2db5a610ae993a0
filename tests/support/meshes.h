#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "core/geometry/triangle_mesh.h"

namespace tessera {

/// A closed mesh: an icosahedron, each triangle cut in four `levels` times, pushed out to the sphere.
inline TriangleMesh icosphere(int levels, float radius = 1, Vec3 center = {}) {
  const auto g = static_cast<float>((1 + std::sqrt(5.0)) / 2);
  TriangleMesh mesh;
  mesh.positions = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                    {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
      if (fresh) mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]) * 0.5F);
      return at->second;
    };
    std::vector<TriangleIndices> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  for (Vec3& p : mesh.positions) p = to_float(to_double(p) / length(to_double(p)) * double{radius} + to_double(center));
  return mesh;
}

/// A ball of radius 1 with smooth normals: `around` × `rings` faces between the poles (0, 0, ±1), triangles at these.
inline TriangleMesh smooth_ball(std::uint32_t around, std::uint32_t rings) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 1}};
  for (std::uint32_t ring = 1; ring < rings; ++ring)
    for (std::uint32_t i = 0; i < around; ++i) {
      const double down = 3.14159265358979 * ring / rings, turn = 2 * 3.14159265358979 * i / around;
      mesh.positions.push_back(
          to_float(Vec3d{std::sin(down) * std::cos(turn), std::sin(down) * std::sin(turn), std::cos(down)}));
    }
  mesh.positions.push_back({0, 0, -1});
  const auto last = static_cast<std::uint32_t>(mesh.positions.size() - 1);
  for (std::uint32_t i = 0; i < around; ++i) {
    const std::uint32_t next = (i + 1) % around;
    mesh.triangles.push_back({0, 1 + i, 1 + next});
    for (std::uint32_t ring = 0; ring + 2 < rings; ++ring) {
      const std::uint32_t above = 1 + ring * around, below = above + around;
      mesh.triangles.push_back({above + i, below + i, below + next});
      mesh.triangles.push_back({above + i, below + next, above + next});
    }
    mesh.triangles.push_back({last - around + i, last, last - around + next});
  }
  mesh.normals = mesh.positions;
  return mesh;
}

/// A closed box around the origin, two triangles a side, whose normals are those of a body that its corners lie on.
inline TriangleMesh smooth_box(Vec3 half) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions.push_back({i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z});
  for (const auto& [a, b, c, d] : {std::array{0U, 2U, 3U, 1U},
                                   {4U, 5U, 7U, 6U},
                                   {0U, 1U, 5U, 4U},
                                   {2U, 6U, 7U, 3U},
                                   {0U, 4U, 6U, 2U},
                                   {1U, 3U, 7U, 5U}}) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
  mesh.normals = mesh.positions;
  return mesh;
}

/// The square [−1, 1]² at z = 0 as 2·n·n triangles.
inline TriangleMesh grid_plane(std::uint32_t n) {
  TriangleMesh mesh;
  for (std::uint32_t y = 0; y <= n; ++y)
    for (std::uint32_t x = 0; x <= n; ++x)
      mesh.positions.push_back({2.0F * static_cast<float>(x) / static_cast<float>(n) - 1,
                                2.0F * static_cast<float>(y) / static_cast<float>(n) - 1, 0});
  for (std::uint32_t y = 0; y < n; ++y)
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t i = y * (n + 1) + x, above = i + n + 1;
      mesh.triangles.push_back({i, i + 1, above + 1});
      mesh.triangles.push_back({i, above + 1, above});
    }
  return mesh;
}

}  // namespace tessera
