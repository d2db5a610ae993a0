#include "core/bounds/convex_hull.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include "core/math/orientation.h"

namespace tessera {
namespace {

using Points = std::span<const Vec3>;

bool lexicographically_less(Vec3 a, Vec3 b) {
  if (a.x != b.x) return a.x < b.x;
  if (a.y != b.y) return a.y < b.y;
  return a.z < b.z;
}

/// The axis along which a, b, c look most like a triangle; −1 when they lie on a line.
int widest_axis(Vec3 a, Vec3 b, Vec3 c) {
  const Vec3d n = abs(cross(to_double(b) - to_double(a), to_double(c) - to_double(a)));
  std::array axes{0, 1, 2};
  std::ranges::sort(axes, std::greater(), [&](int axis) { return n[axis]; });
  for (const int axis : axes)
    if (orientation_along(axis, a, b, c) != 0) return axis;
  return -1;
}

/// An index at which `measure` is greatest and `fits` (which is exact, and may be slow) holds; if that can't be said of
/// the greatest, the first for which it can; none gives points.size().
template <typename Measure, typename Fits>
std::uint32_t farthest(Points points, Measure&& measure, Fits&& fits) {
  std::uint32_t best = 0;
  double most = -1;
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (const double m = measure(points[i]); m > most) most = m, best = i;
  if (fits(points[best])) return best;
  const auto first = std::ranges::find_if(points, fits);
  return static_cast<std::uint32_t>(first - points.begin());
}

/// Andrew's monotone chain, looked at along an axis that doesn't lie in the plane. Counter-clockwise, no three in line.
std::vector<std::uint32_t> polygon(Points points, int axis) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0U);
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::ranges::sort(order, [&](std::uint32_t i, std::uint32_t j) {
    const Vec3 a = points[i], b = points[j];
    return a[u] != b[u] ? a[u] < b[u] : a[v] < b[v];
  });
  std::vector<std::uint32_t> chain;
  const auto walk = [&](auto begin, auto end) {
    const std::size_t start = chain.size();
    for (auto it = begin; it != end; ++it) {
      while (chain.size() >= start + 2 &&
             orientation_along(axis, points[chain[chain.size() - 2]], points[chain.back()], points[*it]) <= 0)
        chain.pop_back();
      chain.push_back(*it);
    }
    chain.pop_back();  // the other chain begins with it
  };
  walk(order.begin(), order.end());
  walk(order.rbegin(), order.rend());
  return chain;
}

/// Both sides of a polygon. The fans start from different corners, so that no diagonal belongs to both.
std::vector<std::array<std::uint32_t, 3>> two_sides(const std::vector<std::uint32_t>& polygon) {
  const std::size_t n = polygon.size();
  std::vector<std::array<std::uint32_t, 3>> faces;
  for (std::size_t i = 1; i + 1 < n; ++i) {
    faces.push_back({polygon[0], polygon[i], polygon[i + 1]});
    faces.push_back({polygon[1], polygon[(i + 2) % n], polygon[i + 1]});
  }
  return faces;
}

/// The hull of points that don't lie in a plane. Seen from a point outside, the faces strictly turned to it are one
/// patch with a simple rim; they give way to a fan from the point to the rim. Faces in the point's own plane stay, so
/// none without area arises.
class Quickhull {
 public:
  /// The corners of a tetrahedron, `d` outside its face abc.
  Quickhull(Points points, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d)
      : points_(points), fan_at_(points.size()) {
    faces_.push_back({{a, c, b}, {3, 2, 1}, {}});
    faces_.push_back({{a, b, d}, {0, 2, 3}, {}});
    faces_.push_back({{b, c, d}, {0, 3, 1}, {}});
    faces_.push_back({{c, a, d}, {0, 1, 2}, {}});
    std::vector<std::uint32_t> all(points.size());
    std::iota(all.begin(), all.end(), 0U);
    distribute(all, 0);
  }

  std::vector<std::array<std::uint32_t, 3>> run() {
    while (!pending_.empty()) {
      const std::uint32_t face = pending_.back();
      pending_.pop_back();
      if (!faces_[face].above.empty()) grow(face, farthest_above(faces_[face]));
    }
    std::vector<std::array<std::uint32_t, 3>> out;
    for (const Face& face : faces_)
      if (!face.gone) out.push_back(face.corners);
    return out;
  }

 private:
  struct Face {
    std::array<std::uint32_t, 3> corners;
    std::array<std::uint32_t, 3> across;  ///< The face beyond the edge from corner i to the next.
    std::vector<std::uint32_t> above;     ///< Points outside of it. Each point is listed once or is inside the hull.
    bool gone = false;
  };
  /// An edge between a face that stays and one that goes, in the direction of the latter.
  struct RimEdge {
    std::uint32_t from, to, beyond;
  };

  bool sees(std::uint32_t point, const Face& face) const {
    const auto [a, b, c] = face.corners;
    return orientation(points_[a], points_[b], points_[c], points_[point]) > 0;
  }

  /// Gives each point to the first face, from this one on, that it lies outside of.
  void distribute(const std::vector<std::uint32_t>& points, std::uint32_t first) {
    for (const std::uint32_t point : points)
      for (std::uint32_t face = first; face < faces_.size(); ++face)
        if (sees(point, faces_[face])) {
          if (faces_[face].above.empty()) pending_.push_back(face);
          faces_[face].above.push_back(point);
          break;
        }
  }

  /// Of equally distant points, one at an end of them: others might be no extreme points.
  std::uint32_t farthest_above(const Face& face) const {
    const Vec3d a = to_double(points_[face.corners[0]]);
    const Vec3d n = cross(to_double(points_[face.corners[1]]) - a, to_double(points_[face.corners[2]]) - a);
    std::uint32_t best = face.above[0];
    double most = -1;
    for (const std::uint32_t point : face.above) {
      const double distance = dot(n, to_double(points_[point]) - a);
      if (distance > most || (distance == most && lexicographically_less(points_[best], points_[point])))
        most = distance, best = point;
    }
    return best;
  }

  void grow(std::uint32_t seen, std::uint32_t apex) {
    // What the apex sees, from face to face.
    std::vector<std::uint32_t> going{seen}, orphans;
    std::vector<RimEdge> rim;
    faces_[seen].gone = true;
    for (std::size_t i = 0; i < going.size(); ++i)
      for (const std::uint32_t next : faces_[going[i]].across)
        if (!faces_[next].gone && sees(apex, faces_[next])) {
          faces_[next].gone = true;
          going.push_back(next);
        }
    for (const std::uint32_t index : going) {
      Face& face = faces_[index];
      for (int i = 0; i < 3; ++i)
        if (!faces_[face.across[i]].gone) rim.push_back({face.corners[i], face.corners[(i + 1) % 3], face.across[i]});
      for (const std::uint32_t point : face.above)
        if (point != apex) orphans.push_back(point);
      face.above = {};
    }

    const auto first = static_cast<std::uint32_t>(faces_.size());
    for (const RimEdge& edge : rim) {
      const auto index = static_cast<std::uint32_t>(faces_.size());
      Face& beyond = faces_[edge.beyond];
      const auto corner = std::ranges::find(beyond.corners, edge.to) - beyond.corners.begin();
      beyond.across[static_cast<std::size_t>(corner)] = index;
      fan_at_[edge.from] = index;
      faces_.push_back({{edge.from, edge.to, apex}, {edge.beyond, 0, 0}, {}});
    }
    for (std::uint32_t index = first; index < faces_.size(); ++index) {
      const std::uint32_t next = fan_at_[faces_[index].corners[1]];
      faces_[index].across[1] = next;
      faces_[next].across[2] = index;
    }
    distribute(orphans, first);
  }

  Points points_;
  std::vector<Face> faces_;
  std::vector<std::uint32_t> pending_;
  std::vector<std::uint32_t> fan_at_;  ///< By vertex of a rim: the new face on the edge that leaves it.
};

}  // namespace

ConvexHull convex_hull(Points points) {
  if (points.empty()) return {};
  const auto [least, greatest] = std::ranges::minmax_element(points, lexicographically_less);
  const auto a = static_cast<std::uint32_t>(least - points.begin());
  const auto b = static_cast<std::uint32_t>(greatest - points.begin());
  const Vec3 pa = points[a], pb = points[b];
  if (pa == pb) return {{a}, {}, 0};

  const Vec3d line = to_double(pb) - to_double(pa);
  const std::uint32_t c = farthest(
      points, [&](Vec3 p) { return length(cross(line, to_double(p) - to_double(pa))); },
      [&](Vec3 p) { return widest_axis(pa, pb, p) >= 0; });
  if (c == points.size()) return {{a, b}, {}, 1};

  const Vec3 pc = points[c];
  const Vec3d normal = cross(line, to_double(pc) - to_double(pa));
  const std::uint32_t d = farthest(
      points, [&](Vec3 p) { return std::abs(dot(normal, to_double(p) - to_double(pa))); },
      [&](Vec3 p) { return orientation(pa, pb, pc, p) != 0; });
  if (d == points.size()) {
    ConvexHull flat{polygon(points, widest_axis(pa, pb, pc)), {}, 2};
    flat.faces = two_sides(flat.vertices);
    return flat;
  }

  ConvexHull hull{{}, {}, 3};
  hull.faces = orientation(pa, pb, pc, points[d]) > 0 ? Quickhull(points, a, b, c, d).run()
                                                      : Quickhull(points, b, a, c, d).run();
  std::vector<bool> used(points.size());
  for (const auto& face : hull.faces)
    for (const std::uint32_t vertex : face) used[vertex] = true;
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (used[i]) hull.vertices.push_back(i);
  return hull;
}

}  // namespace tessera
