#include "proto/import/gltf/bake.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tessera::proto {
namespace {

/// What directions are multiplied with: the linear part, of a size that no float's range minds. Their lengths don't
/// count.
Rows for_directions(Rows m) {
  m[3] = m[7] = m[11] = 0;
  double most = 0;
  for (const double entry : m) most = std::max(most, std::abs(entry));
  for (double& entry : m) entry /= most;
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
  if (sign < 0)
    for (TriangleIndices& t : mesh.triangles) std::swap(t[1], t[2]);
}

}  // namespace tessera::proto
