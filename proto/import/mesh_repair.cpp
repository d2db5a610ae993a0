#include "proto/import/mesh_repair.h"

#include <vector>

#include "core/math/unit_vec3.h"
#include "proto/import/polygon.h"

namespace tessera::proto {
namespace {

constexpr std::string_view kNotFinite = "A triangle with a coordinate that is NaN, infinite or beyond 1e18 was dropped";

void repair_normals(TriangleMesh& mesh, ImportNotes& notes, std::size_t line) {
  std::vector<bool> bad(mesh.normals.size());
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
    bad[i] = !(is_finite(mesh.normals[i]) && max_component(abs(mesh.normals[i])) > 0);
    count += bad[i] ? 1 : 0;
  }
  if (count == 0) return;
  notes.add("A vertex normal without a direction was replaced by that of the triangles around it", line, count);

  std::vector<Vec3d> sums(mesh.normals.size());
  for (const TriangleIndices& t : mesh.triangles) {
    if (!bad[t[0]] && !bad[t[1]] && !bad[t[2]]) continue;
    const Vec3d area = area_vector(mesh.positions, t);
    for (const std::uint32_t corner : t) sums[corner] = sums[corner] + area;
  }
  for (std::size_t i = 0; i < bad.size(); ++i) {
    if (bad[i]) mesh.normals[i] = UnitVec3::normalize(sums[i]).value_or(UnitVec3::z());
  }
}

}  // namespace

void repair_mesh(TriangleMesh& mesh, ImportNotes& notes, std::size_t line) {
  const DroppedTriangles dropped = drop_unusable_triangles(mesh);
  notes.add(kNotFinite, line, dropped.not_finite);
  notes.add("A triangle with two corners in one place was dropped", line, dropped.degenerate);
  repair_normals(mesh, notes, line);
}

void note_lost_polygon(std::size_t corners, ImportNotes& notes, std::size_t line) {
  notes.add(kNotFinite, line, corners - 2);
}

}  // namespace tessera::proto
