#include "proto/import/gltf/bake.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace tessera::proto {
namespace {

/// What directions are multiplied with: the linear part, of a size that no float's range minds. Their lengths don't
/// count.
Rows for_directions(Rows m) {
  m[3] = m[7] = m[11] = 0;
  double most = 0;
  for (const double entry : m) most = std::max(most, std::abs(entry));
  for (double& entry : m) entry = most > 0 ? entry / most : 0;
  return m;
}

/// The same for normals: the inverse's transpose, but for a positive factor. `m` is such a map of directions.
Rows for_normals(const Rows& m, double sign) {
  const Vec3d x{m[0], m[4], m[8]}, y{m[1], m[5], m[9]}, z{m[2], m[6], m[10]};
  const Vec3d yz = cross(y, z) * sign, zx = cross(z, x) * sign, xy = cross(x, y) * sign;
  return for_directions({yz.x, zx.x, xy.x, 0, yz.y, zx.y, xy.y, 0, yz.z, zx.z, xy.z, 0});
}

bool is_translation(const Rows& m) {
  Rows linear = m;
  linear[3] = linear[7] = linear[11] = 0;
  return linear == kIdentity;
}

void turn_over(TriangleIndices& t) { std::swap(t[1], t[2]); }

/// Nothing where a joint isn't there. Weights are fractions of their sum; without any the first joint counts.
std::optional<Rows> mean_of(std::span<const Rows> joints, const std::array<float, 4>& which,
                            const std::array<float, 4>& weights) {
  Rows mean{};
  double sum = 0;
  for (std::size_t i = 0; i < which.size(); ++i) {
    const double weight = weights[i];
    if (!(weight > 0)) continue;
    if (!(which[i] >= 0 && which[i] < static_cast<float>(joints.size()))) return std::nullopt;
    const Rows& joint = joints[static_cast<std::size_t>(which[i])];
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += weight * joint[k];
    sum += weight;
  }
  if (sum == 0) return joints.front();
  for (double& entry : mean) entry /= sum;
  return mean;
}

}  // namespace

void bake(GltfTriangles& triangles, const Rows& to_world, Steps& steps) {
  if (to_world == kIdentity) return;
  TriangleMesh& mesh = triangles.mesh;
  steps.take(mesh.positions.size() / 16);
  for (Vec3& p : mesh.positions) p = to_float(transform_point(to_world, to_double(p)));
  if (is_translation(to_world)) return;

  const double sign = determinant(to_world) < 0 ? -1 : 1;
  const Rows directions = for_directions(to_world), normals = for_normals(directions, sign);
  for (Vec3& n : mesh.normals) n = to_float(transform_vector(normals, to_double(n)));
  for (Tangent& t : triangles.attributes.tangents)
    t = {to_float(transform_vector(directions, to_double(t.direction))), t.sign * static_cast<float>(sign)};
  if (sign >= 0) return;
  for (TriangleIndices& t : mesh.triangles) turn_over(t);
}

bool bake_skin(GltfTriangles& triangles, std::span<const Rows> joints, Steps& steps) {
  TriangleMesh& mesh = triangles.mesh;
  auto& tangents = triangles.attributes.tangents;
  std::vector<bool> is_mirrored(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    steps.take();
    const auto map = mean_of(joints, triangles.joints[i], triangles.weights[i]);
    if (!map) return false;
    const double sign = determinant(*map) < 0 ? -1 : 1;
    is_mirrored[i] = sign < 0;
    mesh.positions[i] = to_float(transform_point(*map, to_double(mesh.positions[i])));
    const Rows directions = for_directions(*map);
    if (!mesh.normals.empty())
      mesh.normals[i] = to_float(transform_vector(for_normals(directions, sign), to_double(mesh.normals[i])));
    if (!tangents.empty())
      tangents[i] = {to_float(transform_vector(directions, to_double(tangents[i].direction))),
                     tangents[i].sign * static_cast<float>(sign)};
  }
  for (TriangleIndices& t : mesh.triangles)
    if (int{is_mirrored[t[0]]} + int{is_mirrored[t[1]]} + int{is_mirrored[t[2]]} > 1) turn_over(t);
  return true;
}

}  // namespace tessera::proto
