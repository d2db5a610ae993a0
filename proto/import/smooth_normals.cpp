#include "proto/import/smooth_normals.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "core/math/portable.h"
#include "core/math/unit_vec3.h"
#include "proto/import/polygon.h"
#include "proto/import/shared_points.h"

namespace tessera::proto {
namespace {

/// What rounding may make of a bend that is just as large as was asked; a cosine.
constexpr double kSlack = 1e-9;

/// A normal of length 1; zero for a triangle without area.
Vec3d normal_of(const TriangleMesh& mesh, const TriangleIndices& triangle) {
  const Vec3d area = area_vector(mesh.positions, triangle);
  const double most = max_component(abs(area));
  if (!(most > 0)) return {};
  const Vec3d scaled = area / most;
  return scaled / length(scaled);
}

class Smoothing {
 public:
  Smoothing(std::span<TriangleMesh* const> meshes, float degrees, Steps& steps)
      : meshes_(meshes), least_cosine_(portable_cos(degrees * std::numbers::pi / 180) - kSlack), steps_(steps) {}

  void smooth() {
    number_places();
    sort_corners();
    for (std::size_t place = 0; place + 1 < first_.size(); ++place) smooth_place(place);
    for (std::size_t m = 0; m < meshes_.size(); ++m) copy_attributes(*meshes_[m], copies_[m]);
  }

 private:
  /// A triangle's corner.
  struct Corner {
    std::uint32_t mesh, triangle, number;
  };
  /// An edge that a corner of a place has, by the corner's position among the place's.
  struct Edge {
    std::uint32_t to;
    std::uint32_t corner;
  };

  void number_places() {
    SharedPoints points;
    std::uint64_t corners = 0;
    for (TriangleMesh* mesh : meshes_) {
      steps_.take(mesh->positions.size());
      std::vector<std::uint32_t>& places = places_.emplace_back();
      for (const Vec3 p : mesh->positions) places.push_back(points.number(p));
      mesh->normals.assign(mesh->positions.size(), UnitVec3::z());
      is_taken_.emplace_back(mesh->positions.size());
      copies_.emplace_back();
      corners += 3 * mesh->triangles.size();
    }
    if (corners > std::numeric_limits<std::uint32_t>::max())
      throw std::length_error("There are too many triangles to make them smooth");
    first_.resize(points.points().size() + 1);
  }

  /// By their places: a counting sort.
  void sort_corners() {
    const auto each = [&](const auto& visit) {
      for (std::uint32_t m = 0; m < meshes_.size(); ++m) {
        steps_.take(meshes_[m]->triangles.size());
        for (std::uint32_t t = 0; t < meshes_[m]->triangles.size(); ++t)
          for (std::uint32_t i = 0; i < 3; ++i) visit(places_[m][meshes_[m]->triangles[t][i]], Corner{m, t, i});
      }
    };
    each([&](std::uint32_t place, Corner) { ++first_[place + 1]; });
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    corners_.resize(first_.back());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    each([&](std::uint32_t place, Corner corner) { corners_[next[place]++] = corner; });
  }

  std::uint32_t vertex(Corner corner, std::uint32_t ahead = 0) const {
    return meshes_[corner.mesh]->triangles[corner.triangle][(corner.number + ahead) % 3];
  }
  std::uint32_t place_of(Corner corner, std::uint32_t ahead) const {
    return places_[corner.mesh][vertex(corner, ahead)];
  }

  void smooth_place(std::size_t place) {
    const std::span<const Corner> corners(corners_.data() + first_[place], first_[place + 1] - first_[place]);
    steps_.take(corners.size());
    normals_.clear();
    for (const Corner corner : corners)
      normals_.push_back(normal_of(*meshes_[corner.mesh], meshes_[corner.mesh]->triangles[corner.triangle]));
    join(corners);

    order_.resize(corners.size());
    std::iota(order_.begin(), order_.end(), 0U);
    std::ranges::sort(order_, {},
                      [&](std::uint32_t i) { return std::tuple(root(i), corners[i].mesh, vertex(corners[i]), i); });
    for (auto begin = order_.begin(); begin != order_.end();) {
      const auto end = std::find_if(begin, order_.end(), [&](std::uint32_t i) { return root(i) != root(*begin); });
      give_normal(corners, {begin, end});
      begin = end;
    }
  }

  /// Puts the corners whose triangles hang together over smooth edges at this place into one set each.
  void join(std::span<const Corner> corners) {
    parents_.resize(corners.size());
    std::iota(parents_.begin(), parents_.end(), 0U);
    edges_.clear();
    for (std::uint32_t i = 0; i < corners.size(); ++i)
      for (const std::uint32_t ahead : {1U, 2U}) edges_.push_back({place_of(corners[i], ahead), i});
    std::ranges::sort(edges_, {}, [](const Edge& edge) { return std::pair(edge.to, edge.corner); });
    for (std::size_t i = 0; i < edges_.size();) {
      std::size_t end = i + 1;
      while (end < edges_.size() && edges_[end].to == edges_[i].to) ++end;
      if (end == i + 2 && bends_little(edges_[i].corner, edges_[i + 1].corner))
        parents_[root(edges_[i].corner)] = root(edges_[i + 1].corner);
      i = end;
    }
  }

  bool bends_little(std::uint32_t a, std::uint32_t b) const {
    return max_component(abs(normals_[a])) > 0 && dot(normals_[a], normals_[b]) >= least_cosine_;
  }

  std::uint32_t root(std::uint32_t i) {
    while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
    return i;
  }

  /// To the corners of one set, which are sorted by their vertices.
  void give_normal(std::span<const Corner> corners, std::span<const std::uint32_t> set) {
    Vec3d sum;
    double angles = 0;
    for (const std::uint32_t i : set) {
      const double angle = angle_at(corners[i]);
      sum = sum + normals_[i] * angle;
      angles += angle;
    }
    // Where both sides of a sheet meet, what is left of their sum is rounding.
    const auto shared = length(sum) > 1e-6 * angles ? UnitVec3::normalize(sum) : std::nullopt;
    std::uint32_t given_to = 0, given = 0;
    for (std::size_t k = 0; k < set.size(); ++k) {
      const Corner corner = corners[set[k]];
      const std::uint32_t old = vertex(corner);
      const bool is_same = k > 0 && shared && corners[set[k - 1]].mesh == corner.mesh && given_to == old;
      if (!is_same) given = own_vertex(corner.mesh, old);
      given_to = old;
      TriangleMesh& mesh = *meshes_[corner.mesh];
      if (!is_same)
        mesh.normals[given] = shared ? *shared : UnitVec3::normalize(normals_[set[k]]).value_or(UnitVec3::z());
      mesh.triangles[corner.triangle][corner.number] = given;
    }
  }

  /// The vertex, or, when it has a normal already, a new one in its place.
  std::uint32_t own_vertex(std::uint32_t m, std::uint32_t old) {
    if (!is_taken_[m][old]) {
      is_taken_[m][old] = true;
      return old;
    }
    TriangleMesh& mesh = *meshes_[m];
    const auto added = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(Vec3(mesh.positions[old]));
    mesh.normals.push_back(UnitVec3::z());
    places_[m].push_back(places_[m][old]);
    copies_[m].push_back(old);
    return added;
  }

  double angle_at(Corner corner) const {
    const std::vector<Vec3>& positions = meshes_[corner.mesh]->positions;
    const auto at = [&](std::uint32_t ahead) { return to_double(positions[vertex(corner, ahead)]); };
    return angle_between(at(1) - at(0), at(2) - at(0));
  }

  static void copy_attributes(TriangleMesh& mesh, const std::vector<std::uint32_t>& copied) {
    if (!mesh.attributes || copied.empty()) return;
    MeshAttributes attributes = *mesh.attributes;
    const auto extend = [&](auto& values) {
      if (values.empty()) return;
      values.reserve(mesh.positions.size());
      for (const std::uint32_t old : copied) values.push_back(values[old]);
    };
    for (std::vector<Vec2>& uvs : attributes.uvs) extend(uvs);
    extend(attributes.tangents);
    extend(attributes.colors);
    mesh.attributes = std::make_shared<const MeshAttributes>(std::move(attributes));
  }

  std::span<TriangleMesh* const> meshes_;
  double least_cosine_;
  Steps& steps_;
  std::vector<std::vector<std::uint32_t>> places_;  ///< Of each mesh's vertices.
  std::vector<std::vector<bool>> is_taken_;         ///< Whether such a vertex has its normal,
  std::vector<std::vector<std::uint32_t>> copies_;  ///< and of which of them those are copies that were added.
  std::vector<std::uint32_t> first_;                ///< Of each place's corners.
  std::vector<Corner> corners_;                     ///< By their places.

  // Of the place that is being looked at.
  std::vector<Vec3d> normals_;          ///< Of its corners' triangles.
  std::vector<std::uint32_t> parents_;  ///< Sets of corners (Tarjan 1975).
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> order_;
};

}  // namespace

void smooth_normals(std::span<TriangleMesh* const> meshes, float degrees, Steps& steps) {
  Smoothing(meshes, degrees, steps).smooth();
}

void smooth_normals(Imported& file, float degrees, const std::stop_token& stop) {
  std::vector<TriangleMesh*> meshes;
  for (ImportedPart& part : file.parts)
    if (auto* mesh = std::get_if<TriangleMesh>(&part.shape); mesh && mesh->normals.empty()) meshes.push_back(mesh);
  Steps steps(stop);
  if (file.placements.empty()) return smooth_normals(meshes, degrees, steps);
  for (TriangleMesh* mesh : meshes) smooth_normals(std::span(&mesh, 1), degrees, steps);
}

}  // namespace tessera::proto
