#include "core/accel/convex_cell.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace tessera {
namespace {

bool is_before(Vec3d a, Vec3d b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); }

/// Where an edge crosses a plane, given its ends' distances from it: the same point whichever face asks.
Vec3d crossing(Vec3d a, double da, Vec3d b, double db) {
  if (is_before(b, a)) return crossing(b, db, a, da);
  return a + (b - a) * (da / (da - db));
}

/// Corners of a convex polygon in its plane, each once, put in order around their middle.
std::vector<Vec3d> in_order(std::vector<Vec3d> corners, Vec3d normal) {
  std::ranges::sort(corners, is_before);
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  Vec3d middle;
  for (const Vec3d c : corners) middle = middle + c / static_cast<double>(corners.size());
  const Vec3d a = abs(normal);
  const Vec3d least = a.x <= a.y && a.x <= a.z ? Vec3d{1, 0, 0} : a.y <= a.z ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
  const Vec3d u = cross(normal, least), v = cross(normal, u) / length(normal);
  std::vector<std::pair<double, Vec3d>> by_angle;
  for (const Vec3d c : corners) by_angle.emplace_back(std::atan2(dot(c - middle, v), dot(c - middle, u)), c);
  std::ranges::sort(by_angle, {}, [](const auto& p) { return p.first; });
  std::ranges::transform(by_angle, corners.begin(), [](const auto& p) { return p.second; });
  return corners;
}

}  // namespace

ConvexCell::ConvexCell(const Aabb& box) {
  const Vec3d lo = to_double(box.lo), hi = to_double(box.hi);
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {lo[axis], hi[axis]}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      Polygon face(4);
      for (int i = 0; i < 4; ++i) {
        Vec3d& corner = face[static_cast<std::size_t>(i)];
        corner[axis] = side;
        corner[u] = i == 1 || i == 2 ? hi[u] : lo[u];
        corner[v] = i >= 2 ? hi[v] : lo[v];
      }
      faces_.push_back(std::move(face));
    }
}

std::pair<ConvexCell, ConvexCell> ConvexCell::parts(const FreePlane& plane) const {
  const Vec3d n = to_double(plane.normal);
  ConvexCell below, above;
  std::vector<Vec3d> cut;
  below.faces_.reserve(faces_.size() + 1);
  above.faces_.reserve(faces_.size() + 1);
  cut.reserve(2 * faces_.size());
  for (const Polygon& face : faces_) {
    Polygon lower, upper;
    lower.reserve(face.size() + 1);
    upper.reserve(face.size() + 1);
    for (std::size_t i = 0; i < face.size(); ++i) {
      const Vec3d a = face[i], b = face[(i + 1) % face.size()];
      const double da = dot(n, a) - plane.offset, db = dot(n, b) - plane.offset;
      if (da <= 0) lower.push_back(a);
      if (da >= 0) upper.push_back(a);
      if ((da < 0 && db > 0) || (da > 0 && db < 0)) {
        const Vec3d between = crossing(a, da, b, db);
        lower.push_back(between);
        upper.push_back(between);
        cut.push_back(between);
      } else if (da == 0) {
        cut.push_back(a);
      }
    }
    if (lower.size() >= 3) below.faces_.push_back(std::move(lower));
    if (upper.size() >= 3) above.faces_.push_back(std::move(upper));
  }
  if (below.faces_.empty() || above.faces_.empty()) return {std::move(below), std::move(above)};
  Polygon cap = in_order(std::move(cut), n);
  if (cap.size() >= 3) {
    below.faces_.push_back(cap);
    above.faces_.push_back(std::move(cap));
  }
  return {std::move(below), std::move(above)};
}

double ConvexCell::half_surface() const {
  double twice = 0;
  for (const Polygon& face : faces_) {
    Vec3d sum;
    for (std::size_t i = 2; i < face.size(); ++i) sum = sum + cross(face[i - 1] - face[0], face[i] - face[0]);
    twice += length(sum);
  }
  return twice / 4;
}

std::size_t ConvexCell::corner_count() const {
  std::size_t count = 0;
  for (const Polygon& face : faces_) count += face.size();
  return count;
}

Aabb ConvexCell::box() const {
  Vec3d lo{kInfinity, kInfinity, kInfinity}, hi = -lo;
  for (const Polygon& face : faces_)
    for (const Vec3d corner : face) {
      lo = min(lo, corner);
      hi = max(hi, corner);
    }
  if (!(lo.x <= hi.x)) return {};
  const double margin = 0x1p-40 * max_component(max(abs(lo), abs(hi)));
  return outward(lo - Vec3d{margin, margin, margin}, hi + Vec3d{margin, margin, margin});
}

std::pair<double, double> ConvexCell::extent(Vec3 n) const {
  std::pair<double, double> range{kInfinity, -kInfinity};
  for (const Polygon& face : faces_)
    for (const Vec3d corner : face) {
      const double at = dot(to_double(n), corner);
      range = {std::min(range.first, at), std::max(range.second, at)};
    }
  return range;
}

}  // namespace tessera
