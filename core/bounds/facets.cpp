#include "core/bounds/facets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

namespace tessera {
namespace {

/// Nothing for a vector of no length.
void add(std::vector<Facet>& facets, Vec3d normal, double weight) {
  const double l = length(normal);
  if (l > 0) facets.push_back({normal / l, weight});
}

/// Across the face, outward, twice as long as the face has area.
Vec3d normal_of(const std::array<std::uint32_t, 3>& face, std::span<const Vec3> points) {
  const Vec3d a = to_double(points[face[0]]);
  return cross(to_double(points[face[1]]) - a, to_double(points[face[2]]) - a);
}

/// Any direction across `v`.
Vec3d across(Vec3d v) {
  const Vec3d a = abs(v);
  return cross(v, a.x <= a.y && a.x <= a.z ? Vec3d{1, 0, 0} : a.y <= a.z ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1});
}

/// Faces in one plane differ by the rounding of their normals, far less than this.
auto direction_key(const Facet& facet) {
  const Vec3d n = facet.normal;
  return std::tuple(std::round(n.x * 0x1p20), std::round(n.y * 0x1p20), std::round(n.z * 0x1p20));
}

/// Those of one direction become one. (Two sides of a boundary between keys stay two, which costs a plane at most.)
void merge(std::vector<Facet>& facets) {
  std::ranges::sort(facets, {}, direction_key);
  std::size_t kept = 0;
  for (const Facet& facet : facets)
    if (kept > 0 && direction_key(facets[kept - 1]) == direction_key(facet))
      facets[kept - 1].weight += facet.weight;
    else
      facets[kept++] = facet;
  facets.resize(kept);
}

/// Faces whose normals have a smaller cosine meet at less than 60°.
constexpr double kSharp = -0.5;

/// Along an edge the faces reach out in the directions e × n₁ and −e × n₂; the bevel takes the one in between. It has
/// no area; with the square of the edge it competes with the faces.
void add_bevels(const ConvexHull& hull, std::span<const Vec3> points, std::vector<Facet>& facets) {
  struct Edge {
    std::uint32_t low, high;
    Vec3d normal;
  };
  std::vector<Edge> edges;
  for (const auto& face : hull.faces) {
    const Vec3d n = normal_of(face, points);
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t from = face[i], to = face[(i + 1) % 3];
      // Seen along the edge from its lower end, so that the two faces' e × n point the same way.
      edges.push_back({std::min(from, to), std::max(from, to), (from < to ? n : -n) / length(n)});
    }
  }
  std::ranges::sort(edges, {}, [](const Edge& e) { return std::pair(e.low, e.high); });
  for (std::size_t i = 0; i + 1 < edges.size(); i += 2) {
    const auto& [low, high, n] = edges[i];
    if (!(dot(n, -edges[i + 1].normal) < kSharp)) continue;
    const Vec3d e = to_double(points[high]) - to_double(points[low]);
    add(facets, cross(e, n + edges[i + 1].normal), dot(e, e));
  }
}

}  // namespace

std::vector<Facet> facets_of(const ConvexHull& hull, std::span<const Vec3> points) {
  std::vector<Facet> facets;
  if (hull.dimension == 1) {
    const Vec3d line = to_double(points[hull.vertices[1]]) - to_double(points[hull.vertices[0]]);
    const Vec3d u = across(line), v = cross(line, u / length(u));
    for (const Vec3d n : {u, v, line}) {
      add(facets, n, 1);
      add(facets, -n, 1);
    }
    return facets;
  }
  for (const auto& face : hull.faces) {
    const Vec3d n = normal_of(face, points);
    add(facets, n, 0.5 * length(n));
  }
  merge(facets);
  add_bevels(hull, points, facets);
  return facets;
}

double half_area(const ConvexHull& hull, std::span<const Vec3> points) {
  double twice = 0;
  for (const auto& face : hull.faces) twice += length(normal_of(face, points)) / 2;
  return twice / 2;
}

std::vector<Facet> spread(std::vector<Facet> facets, std::size_t count) {
  if (facets.size() <= count) return facets;
  std::vector<Facet> chosen;
  std::vector<double> turned(facets.size(), 2);  // 1 − cosine of the angle to the nearest chosen one
  while (chosen.size() < count) {
    std::size_t best = 0;
    double most = -1;
    for (std::size_t i = 0; i < facets.size(); ++i)
      if (const double score = turned[i] * std::sqrt(facets[i].weight); score > most) most = score, best = i;
    chosen.push_back(facets[best]);
    for (std::size_t i = 0; i < facets.size(); ++i)
      turned[i] = std::min(turned[i], 1 - dot(facets[i].normal, facets[best].normal));
    turned[best] = 0;
  }
  return chosen;
}

}  // namespace tessera
