#include "proto/import/gltf/triangles.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <string>

#include "proto/import/gltf/draco.h"

namespace tessera::proto {
namespace {

/// What stands for "begin anew" in indices of that type.
std::uint32_t restart_index(ComponentType type) {
  switch (type) {
    case ComponentType::uint8:
      return 0xFF;
    case ComponentType::uint16:
      return 0xFFFF;
    default:
      return 0xFFFFFFFF;
  }
}

/// Triangles of a strip or fan (glTF 2.0, 3.7.2.1).
std::vector<TriangleIndices> triangles_of(Topology topology, const std::vector<std::uint32_t>& indices) {
  std::vector<TriangleIndices> triangles;
  triangles.reserve(indices.size());
  for (std::size_t i = 0; i + 2 < indices.size(); ++i) {
    const TriangleIndices t = topology == Topology::triangle_fan
                                  ? TriangleIndices{indices[i + 1], indices[i + 2], indices[0]}
                                  : TriangleIndices{indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);  // else it joins two strips
  }
  return triangles;
}

std::span<std::uint32_t> corners_of(std::vector<TriangleIndices>& triangles) {
  return {triangles.empty() ? nullptr : triangles.front().data(), triangles.size() * 3};
}

class TriangleReader {
 public:
  TriangleReader(const Primitive& primitive, Accessors& accessors, GltfFile& file)
      : primitive_(primitive), accessors_(accessors), file_(file), vertices_(accessors[*primitive.position].count) {}

  std::optional<GltfTriangles> read() {
    if (!read_corners()) return std::nullopt;
    auto& positions = out_.mesh.positions;
    leave_out_unused();
    const std::size_t vertices = used_.empty() ? vertices_ : used_.size();
    if (!file_.take(vertices * bytes_of_vertex(), primitive_.where)) return std::nullopt;
    positions = read<Vec3>(primitive_.position);
    out_.mesh.normals = read<Vec3>(primitive_.normal);
    for (std::size_t set = 0; set < primitive_.uvs.size(); ++set)
      out_.attributes.uvs[set] = read<Vec2>(primitive_.uvs[set]);
    if (primitive_.normal) out_.attributes.tangents = read<Tangent>(primitive_.tangent);
    read_colors();
    if (primitive_.joints && primitive_.weights) {
      out_.joints = read<std::array<float, 4>>(primitive_.joints);
      out_.weights = read<std::array<float, 4>>(primitive_.weights);
    }
    if (!file_.errors().empty()) return std::nullopt;
    return std::move(out_);
  }

 private:
  std::uint64_t bytes_of_vertex() const {
    std::uint64_t bytes = sizeof(Vec3);
    if (primitive_.normal) bytes += sizeof(Vec3);
    if (primitive_.normal && primitive_.tangent) bytes += sizeof(Tangent);
    if (primitive_.color) bytes += 2 * sizeof(std::array<float, 4>);
    if (primitive_.joints) bytes += 2 * sizeof(std::array<float, 4>);
    for (const auto& uv : primitive_.uvs) bytes += uv ? sizeof(Vec2) : 0;
    return bytes;
  }

  bool read_corners() {
    const std::uint64_t indices = primitive_.indices ? accessors_[*primitive_.indices].count : vertices_;
    const bool are_triangles = primitive_.topology == Topology::triangles;
    if (are_triangles ? indices % 3 != 0 : indices < 3)
      file_.note(primitive_.where, "Indices that make no whole triangle are ignored");
    const std::uint64_t triangles = are_triangles ? indices / 3 : std::max<std::uint64_t>(indices, 2) - 2;
    if (!file_.take(triangles * sizeof(TriangleIndices) + (are_triangles ? 0 : 4 * indices), primitive_.where))
      return false;
    file_.steps().take(triangles / 16);
    if (are_triangles) {
      out_.mesh.triangles.resize(triangles);
      return read_indices(corners_of(out_.mesh.triangles));
    }
    std::vector<std::uint32_t> corners(indices);
    if (!read_indices(corners)) return false;
    out_.mesh.triangles = triangles_of(primitive_.topology, corners);
    return true;
  }

  bool read_indices(std::span<std::uint32_t> out) {
    if (!primitive_.indices) {
      std::iota(out.begin(), out.end(), 0U);
      return true;
    }
    const Accessor& indices = accessors_[*primitive_.indices];
    if (!accessors_.read_indices(*primitive_.indices, out)) return false;
    const std::uint64_t end = std::min<std::uint64_t>(vertices_, restart_index(indices.type));
    std::uint32_t most = 0;
    for (const std::uint32_t i : out) most = std::max(most, i);
    if (most < end || out.empty()) return true;
    const auto bad = std::ranges::find_if(out, [&](std::uint32_t i) { return i >= end; });
    return indices.where.error("Index " + std::to_string(bad - out.begin()) + " is " + std::to_string(*bad) +
                               (*bad >= vertices_
                                    ? "; there are only " + std::to_string(vertices_) + " vertices."
                                    : ", which stands for a restart of the primitive, and glTF has none."));
  }

  /// Many primitives may share long lists of vertices, of which each uses a few.
  void leave_out_unused() {
    const auto corners = corners_of(out_.mesh.triangles);
    if (corners.empty() || corners.size() >= vertices_ / 4) return;
    used_.assign(corners.begin(), corners.end());
    std::ranges::sort(used_);
    used_.erase(std::unique(used_.begin(), used_.end()), used_.end());
    for (std::uint32_t& corner : corners)
      corner = static_cast<std::uint32_t>(std::ranges::lower_bound(used_, corner) - used_.begin());
    file_.steps().take(corners.size());
  }

  template <typename Element>
  std::vector<Element> read(const std::optional<std::uint32_t>& accessor) {
    return accessor ? accessors_.read<Element>(*accessor, used_) : std::vector<Element>();
  }

  void read_colors() {
    if (!primitive_.color) return;
    auto& colors = out_.attributes.colors;
    if (accessors_[*primitive_.color].components == 4) {
      colors = read<std::array<float, 4>>(primitive_.color);
      return;
    }
    for (const auto& [r, g, b] : read<std::array<float, 3>>(primitive_.color)) colors.push_back({r, g, b, 1});
  }

  const Primitive& primitive_;
  Accessors& accessors_;
  GltfFile& file_;
  std::uint64_t vertices_;
  std::vector<std::uint32_t> used_;  ///< Vertices, ascending, where the others are left out; else empty.
  GltfTriangles out_;
};

}  // namespace

std::optional<GltfTriangles> read_triangles(const Primitive& primitive, Accessors& accessors, GltfBuffers& buffers,
                                            GltfFile& file) {
  if (primitive.draco) return read_draco(primitive, accessors, buffers, file);
  return TriangleReader(primitive, accessors, file).read();
}

}  // namespace tessera::proto
