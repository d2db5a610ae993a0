#pragma once

#include "tests/support/scenes.h"

namespace tessera {

/// Adds a closed box of 12 triangles, outward.
inline void append_box(TriangleMesh& mesh, const Aabb& box) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (unsigned i = 0; i < 8; ++i)
    mesh.positions.push_back({(i & 1 ? box.hi : box.lo).x, (i & 2 ? box.hi : box.lo).y, (i & 4 ? box.hi : box.lo).z});
  const TriangleIndices faces[] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  for (const auto& [a, b, c] : faces) mesh.triangles.push_back({first + a, first + b, first + c});
}

inline Quad flat_quad(int axis, Vec3 corner, float width, float height) {
  Vec3 u{}, v{};
  u[(axis + 1) % 3] = width;
  v[(axis + 2) % 3] = height;
  return {{{corner, corner + u, corner + u + v, corner + v}}};
}

/// Unit cubes with gaps of 1 between them, all faces, edges and corners at whole numbers from −5 to 6: as one mesh, as
/// quads in the gaps, as spheres that touch their cells, and as an instance of a cube (moved by whole numbers, so that
/// its rays aren't rounded).
inline std::shared_ptr<const Scene> block_scene() {
  SceneBuilder b;
  TriangleMesh cubes, cube;
  const auto at = [](int i) { return static_cast<float>(2 * i + 1); };
  for (int i = -3; i < 3; ++i)
    for (int j = -3; j < 3; ++j)
      for (int k = -3; k < 3; ++k) {
        const Vec3 lo{at(i), at(j), at(k)};
        if ((i + j + k) % 3 == 0) append_box(cubes, {lo, lo + Vec3{1, 1, 1}});
      }
  append_box(cube, {{0, 0, 0}, {1, 1, 1}});
  b.add(cubes);
  for (int i = -3; i < 3; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 corner{at(i), at(-i - 1), at(i)};
      b.add(flat_quad(axis, corner + Vec3{-1, -1, -1}, 1, 2));
    }
  b.add(Sphere{{0.5F, 0.5F, 0.5F}, 0.5F}).add(Sphere{{-2.5F, 0.5F, 2.5F}, 0.5F});
  const auto shape = b.shape(cube);
  b.place(shape, 0, placed({1, 0, 0, 2, 0, 1, 0, -2, 0, 0, 1, 2}))
      .place(shape, 0, placed({1, 0, 0, -4, 0, 1, 0, 4, 0, 0, 1, -4}));
  return b.build();
}

/// A whole or a half number where faces, edges and cells of `block_scene` are.
inline Vec3 lattice_point(Random& random, int reach = 6) {
  Vec3 p;
  for (int axis = 0; axis < 3; ++axis)
    p[axis] =
        static_cast<float>(static_cast<int>(random.bits() % static_cast<unsigned>(4 * reach + 1)) - 2 * reach) / 2;
  return p;
}

}  // namespace tessera
