#include "tests/benchmarks/support/mesh_files.h"

#include <bit>

#include "tests/benchmarks/support/text_file.h"

namespace tessera::bench {
namespace {

static_assert(std::endian::native == std::endian::little, "write_ply writes floats as they lie in memory");

TextFile& operator<<(TextFile& file, Vec3 v) { return file << v.x << " " << v.y << " " << v.z; }

void write_corner(TextFile& file, std::uint32_t index, ObjCorners corners) {
  const std::uint32_t from_one = index + 1;
  file << " " << from_one;
  if (corners == ObjCorners::v_vn) file << "//" << from_one;
  if (corners == ObjCorners::v_vt_vn) file << "/" << from_one << "/" << from_one;
}

}  // namespace

void write_obj(const TriangleMesh& mesh, ObjCorners corners, const std::filesystem::path& path) {
  TextFile file(path);
  for (const Vec3 p : mesh.positions) file << "v " << p << "\n";
  if (corners == ObjCorners::v_vt_vn)
    for (const Vec3 p : mesh.positions) file << "vt " << p.x << " " << p.z << "\n";
  if (corners != ObjCorners::v)
    for (const Vec3 n : mesh.normals) file << "vn " << n << "\n";
  for (const TriangleIndices& t : mesh.triangles) {
    file << "f";
    for (const std::uint32_t corner : t) write_corner(file, corner, corners);
    file << "\n";
  }
  file.close();
}

void write_ply(const TriangleMesh& mesh, PlyBody body, const std::filesystem::path& path) {
  TextFile file(path);
  const bool is_text = body == PlyBody::ascii;
  file << "ply\nformat " << (is_text ? "ascii" : "binary_little_endian") << " 1.0\nelement vertex "
       << mesh.positions.size() << "\nproperty float x\nproperty float y\nproperty float z\n"
       << (mesh.normals.empty() ? "" : "property float nx\nproperty float ny\nproperty float nz\n") << "element face "
       << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    is_text ? void(file << mesh.positions[i]) : file.write_raw(mesh.positions[i]);
    if (!mesh.normals.empty()) is_text ? void(file << " " << mesh.normals[i]) : file.write_raw(mesh.normals[i]);
    if (is_text) file << "\n";
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    if (is_text) {
      file << "3 " << a << " " << b << " " << c << "\n";
    } else {
      file.write_raw(std::uint8_t{3});
      file.write_raw(std::array{a, b, c});
    }
  }
  file.close();
}

}  // namespace tessera::bench
