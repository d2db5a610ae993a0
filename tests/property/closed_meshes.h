#pragma once

#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/support/imported_scene.h"
#include "tests/support/meshes.h"
#include "tests/support/random.h"
#include "tests/support/shared_data.h"

namespace tessera {

struct ClosedMesh {
  std::string name;
  TriangleMesh mesh;
};

/// `slices` × `stacks` patches of a sphere, with one vertex at each pole.
inline TriangleMesh globe(std::uint32_t slices, std::uint32_t stacks, double radius) {
  TriangleMesh mesh;
  const double pi = std::numbers::pi;
  mesh.positions = {to_float({0, 0, radius}), to_float({0, 0, -radius})};
  const auto at = [&](std::uint32_t stack, std::uint32_t slice) { return 2 + (stack - 1) * slices + slice % slices; };
  for (std::uint32_t i = 1; i < stacks; ++i)
    for (std::uint32_t j = 0; j < slices; ++j) {
      const double theta = pi * i / stacks, phi = 2 * pi * j / slices;
      const double s = std::sin(theta);
      mesh.positions.push_back(to_float(Vec3d{s * std::cos(phi), s * std::sin(phi), std::cos(theta)} * radius));
    }
  for (std::uint32_t j = 0; j < slices; ++j) {
    mesh.triangles.push_back({0, at(1, j), at(1, j + 1)});
    mesh.triangles.push_back({1, at(stacks - 1, j + 1), at(stacks - 1, j)});
    for (std::uint32_t i = 1; i + 1 < stacks; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

/// A tube around a knot: closed, and nowhere convex.
inline TriangleMesh knot(std::uint32_t along, std::uint32_t around) {
  TriangleMesh mesh;
  const double turn = 2 * std::numbers::pi;
  const auto center = [&](double t) {
    return Vec3d{std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t), -std::sin(3 * t)};
  };
  for (std::uint32_t i = 0; i < along; ++i) {
    const double t = turn * i / along;
    const Vec3d c = center(t), tangent = center(t + 1e-3) - c;
    const Vec3d side = cross(tangent, {0.1, 0.2, 1}), u = side / length(side), v = cross(u, tangent) / length(tangent);
    for (std::uint32_t j = 0; j < around; ++j)
      mesh.positions.push_back(
          to_float(c + (u * std::cos(turn * j / around) + v * std::sin(turn * j / around)) * 0.35));
  }
  for (std::uint32_t i = 0; i < along; ++i)
    for (std::uint32_t j = 0; j < around; ++j) {
      const std::uint32_t a = i * around + j, b = i * around + (j + 1) % around;
      const std::uint32_t c = (i + 1) % along * around + (j + 1) % around, d = (i + 1) % along * around + j;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  return mesh;
}

inline std::vector<ClosedMesh> made_closed_meshes() {
  return {{"ball", icosphere(3)}, {"knot", knot(60, 10)}, {"globe", globe(16, 16, 2)}};
}

/// Those of the shared data that its manifest calls closed; none where the data is missing.
inline std::vector<ClosedMesh> shared_closed_meshes() {
  std::vector<ClosedMesh> out;
  const auto data = shared_data();
  if (!data) return out;
  const auto manifest = nlohmann::json::parse(std::ifstream(*data / "meshes/manifest.json"));
  for (const auto& [name, facts] : manifest.items()) {
    if (!facts["closed"].get<bool>()) continue;
    const auto scene = imported_scene(*data / "meshes" / name);
    ClosedMesh closed{name, {}};
    for (const Shape& part : scene->shapes) {
      const auto& mesh = std::get<TriangleMesh>(part);
      const auto first = static_cast<std::uint32_t>(closed.mesh.positions.size());
      closed.mesh.positions.insert(closed.mesh.positions.end(), mesh.positions.begin(), mesh.positions.end());
      for (const auto& [a, b, c] : mesh.triangles) closed.mesh.triangles.push_back({first + a, first + b, first + c});
    }
    out.push_back(std::move(closed));
  }
  return out;
}

/// How often a closed mesh goes round the point: the solid angle of all triangles over 4π (Van Oosterom & Strackee
/// 1983). Not 0 means that every ray from the point has to meet the mesh.
inline double winding_number(const TriangleMesh& mesh, Vec3 point) {
  double sum = 0;
  const Vec3d p = to_double(point);
  for (const auto& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.positions[t[0]]) - p, b = to_double(mesh.positions[t[1]]) - p,
                c = to_double(mesh.positions[t[2]]) - p;
    const double la = length(a), lb = length(b), lc = length(c);
    sum += std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (2 * std::numbers::pi);
}

/// Random points that the mesh goes round; fewer where they are hard to find.
inline std::vector<Vec3> points_inside(const TriangleMesh& mesh, Random& random, std::size_t count) {
  Aabb box;
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t corner : t) box.extend(mesh.positions[corner]);
  std::vector<Vec3> out;
  for (int tries = 0; tries < 400 && out.size() < count; ++tries) {
    Vec3 p;
    for (int axis = 0; axis < 3; ++axis) p[axis] = static_cast<float>(random.uniform(box.lo[axis], box.hi[axis]));
    if (std::abs(winding_number(mesh, p)) > 0.9) out.push_back(p);
  }
  return out;
}

}  // namespace tessera
