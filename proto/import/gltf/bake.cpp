#include "proto/import/gltf/bake.h"

#include <algorithm>
#include <utility>

#include "core/math/unit_vec3.h"

namespace tessera::proto {
namespace {

/// What normals are multiplied with: the inverse's transpose, but for a positive factor.
Rows cofactors(const Rows& m, double sign) {
  const Vec3d x{m[0], m[4], m[8]}, y{m[1], m[5], m[9]}, z{m[2], m[6], m[10]};
  const Vec3d yz = cross(y, z) * sign, zx = cross(z, x) * sign, xy = cross(x, y) * sign;
  return {yz.x, zx.x, xy.x, 0, yz.y, zx.y, xy.y, 0, yz.z, zx.z, xy.z, 0};
}

bool is_translation(const Rows& m) {
  Rows linear = m;
  linear[3] = linear[7] = linear[11] = 0;
  return linear == kIdentity;
}

/// One that has no direction stays without.
Vec3 turned(const Rows& m, Vec3 v) {
  const auto direction = UnitVec3::normalize(transform_vector(m, to_double(v)));
  return direction ? direction->vec() : Vec3{};
}

}  // namespace

void bake(GltfTriangles& triangles, const Rows& to_world, Steps& steps) {
  if (to_world == kIdentity) return;
  TriangleMesh& mesh = triangles.mesh;
  steps.take(mesh.positions.size() / 16);
  for (Vec3& p : mesh.positions) p = to_float(transform_point(to_world, to_double(p)));
  if (is_translation(to_world)) return;

  const double sign = determinant(to_world) < 0 ? -1 : 1;
  const Rows normals = cofactors(to_world, sign);
  for (Vec3& n : mesh.normals) n = turned(normals, n);
  for (Tangent& t : triangles.attributes.tangents)
    t = {turned(to_world, t.direction), t.sign * static_cast<float>(sign)};
  if (sign < 0)
    for (TriangleIndices& t : mesh.triangles) std::swap(t[1], t[2]);
}

}  // namespace tessera::proto
