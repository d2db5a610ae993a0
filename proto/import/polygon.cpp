#include "proto/import/polygon.h"

#include <array>
#include <cmath>
#include <numbers>

#include "core/math/portable.h"
#include "proto/import/point_tree.h"

namespace tessera::proto {
namespace {

/// Drops the coordinate along which a polygon is thinnest, so that its image runs counter-clockwise. The others
/// stay as they are: points on a line stay on a line.
class Projection {
 public:
  explicit Projection(Vec3d normal) {
    const Vec3d size = abs(normal);
    const int dropped = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const bool mirrored = normal[dropped] < 0;
    first_ = (dropped + (mirrored ? 2 : 1)) % 3;
    second_ = (dropped + (mirrored ? 1 : 2)) % 3;
  }

  Point operator()(Vec3 p) const { return {p[first_], p[second_]}; }

 private:
  int first_, second_;
};

bool is_fan(std::span<const Vec3> positions, std::span<const std::uint32_t> corners, const Projection& flat) {
  const Point center = flat(positions[corners[0]]);
  Point last = flat(positions[corners[1]]);
  for (std::size_t i = 2; i < corners.size(); ++i) {
    const Point next = flat(positions[corners[i]]);
    if (!(turn(center, last, next) > 0)) return false;
    last = next;
  }
  return true;
}

/// How much an ear must satisfy. A simple polygon needs only `clean` (two ears theorem); the others finish polygons
/// that touch or cross themselves, or whose corners all but do.
enum class Demand { clean, tolerant, convex, none };

/// The polygon while ears are cut off: a ring of the corners that are left.
class Ring {
 public:
  Ring(std::vector<Point> points, Steps& steps)
      : points_(std::move(points)),
        corners_(ring_of(points_)),
        in_the_way_(points_, not_convex(corners_), steps),
        steps_(steps),
        left_(points_.size()) {}

  /// Calls `emit(a, b, c)` for every triangle.
  template <typename Emit>
  void cut(const Emit& emit) {
    for (const Demand demand : {Demand::clean, Demand::tolerant, Demand::convex, Demand::none}) {
      // Every other corner first: neighbours make a fan of thin triangles.
      std::vector<std::uint32_t> candidates;
      for (std::uint32_t parity : {0U, 1U}) {
        for (std::uint32_t i = parity; i < corners_.size(); i += 2) candidates.push_back(i);
      }
      // Cutting an ear makes ears of its neighbours at most, so only they are asked again.
      for (std::size_t next = 0; next < candidates.size() && left_ > 3; ++next) {
        const std::uint32_t tip = candidates[next];
        steps_.take();
        if (corners_[tip].gone || !is_ear(tip, demand)) continue;
        const Corner ear = corners_[tip];
        emit(ear.before, tip, ear.after);
        remove(tip);
        candidates.push_back(ear.before);
        candidates.push_back(ear.after);
      }
      if (left_ == 3) break;
    }
    std::uint32_t last = 0;
    while (corners_[last].gone) ++last;
    emit(corners_[last].before, last, corners_[last].after);
  }

 private:
  struct Corner {
    std::uint32_t before, after;
    bool convex;  ///< Turns left, strictly; only the others can lie in an ear.
    bool gone;
  };

  static std::vector<Corner> ring_of(std::span<const Point> points) {
    const auto n = static_cast<std::uint32_t>(points.size());
    std::vector<Corner> corners;
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t before = (i + n - 1) % n, after = (i + 1) % n;
      corners.push_back({before, after, turn(points[before], points[i], points[after]) > 0, false});
    }
    return corners;
  }

  static std::vector<bool> not_convex(std::span<const Corner> corners) {
    std::vector<bool> result;
    for (const Corner& corner : corners) result.push_back(!corner.convex);
    return result;
  }

  double turn_at(std::uint32_t i) const {
    return turn(points_[corners_[i].before], points_[i], points_[corners_[i].after]);
  }

  void update(std::uint32_t i) {
    corners_[i].convex = turn_at(i) > 0;
    corners_[i].convex ? in_the_way_.erase(i) : in_the_way_.insert(i);
  }

  void remove(std::uint32_t i) {
    const Corner corner = corners_[i];
    corners_[i].gone = true;
    in_the_way_.erase(i);
    corners_[corner.before].after = corner.after;
    corners_[corner.after].before = corner.before;
    update(corner.before);
    update(corner.after);
    --left_;
  }

  bool is_ear(std::uint32_t tip, Demand demand) const {
    if (demand == Demand::none) return true;
    const Corner& corner = corners_[tip];
    if (points_[corner.before] == points_[corner.after]) return true;  // Out and back: nothing lies between.
    if (demand == Demand::tolerant ? !(turn_at(tip) >= 0) : !corner.convex) return false;
    if (demand == Demand::convex) return true;
    // Where more corners than that are at the tip's place, the ear is left to the next demand, which none is against.
    constexpr int kMostAtTip = 64;
    int at_tip = 0;
    const auto is_against = [&](std::uint32_t i) {
      if (i == corner.before || i == tip || i == corner.after) return false;
      if (points_[i] == points_[tip] && ++at_tip > kMostAtTip) return true;
      return is_in_the_way(i, tip, demand);
    };
    return !in_the_way_.any_in({points_[corner.before], points_[tip], points_[corner.after]},
                               demand == Demand::tolerant, is_against);
  }

  bool is_in_the_way(std::uint32_t i, std::uint32_t tip, Demand demand) const {
    const Point a = points_[corners_[tip].before], b = points_[tip], c = points_[corners_[tip].after];
    const Point p = points_[i];
    const double ab = turn(a, b, p), bc = turn(b, c, p), ca = turn(c, a, p);
    if (demand == Demand::tolerant) return ab > 0 && bc > 0 && ca > 0;
    if (ab < 0 || bc < 0 || ca < 0) return false;
    // Where the polygon touches itself: what matters is on which side the other corner's own sides run. At a and c
    // they would have to end inside the ear, and are found there; at the tip they may cross it.
    if (p == a || p == c) return false;
    if (p == b) return runs_into_ear(i, tip, corners_[i].before) || runs_into_ear(i, tip, corners_[i].after);
    return true;
  }

  bool runs_into_ear(std::uint32_t from, std::uint32_t tip, std::uint32_t to) const {
    const Point a = points_[corners_[tip].before], c = points_[corners_[tip].after];
    return turn(a, points_[from], points_[to]) > 0 && turn(points_[from], c, points_[to]) > 0;
  }

  std::vector<Point> points_;
  std::vector<Corner> corners_;
  PointTree in_the_way_;  ///< The corners that are left and aren't convex.
  Steps& steps_;
  std::size_t left_;
};

}  // namespace

Vec3d area_vector(std::span<const Vec3> positions, std::span<const std::uint32_t> corners) {
  const Vec3d origin = to_double(positions[corners.front()]);
  Vec3d sum;
  for (std::size_t i = 2; i < corners.size(); ++i) {
    sum = sum + cross(to_double(positions[corners[i - 1]]) - origin, to_double(positions[corners[i]]) - origin);
  }
  return sum;
}

double angle_between(Vec3d a, Vec3d b) {
  const double lengths = length(a) * length(b);
  if (!(lengths > 0)) return 0;
  const double ahead = lengths + dot(a, b);
  return ahead > 0 ? 2 * portable_atan(length(cross(a, b)) / ahead) : std::numbers::pi;
}

bool triangulate(std::span<const Vec3> positions, std::span<const std::uint32_t> corners,
                 std::vector<TriangleIndices>& triangles, Steps& steps) {
  steps.take(corners.size());
  for (const std::uint32_t corner : corners) {
    if (!(max_component(abs(positions[corner])) <= kLargestCoordinate) || !is_finite(positions[corner])) return false;
  }
  const auto add_fan = [&] {
    for (std::size_t i = 2; i < corners.size(); ++i) {
      triangles.push_back({corners[0], corners[i - 1], corners[i]});
    }
    return true;
  };
  if (corners.size() == 3) return add_fan();

  const Vec3d normal = area_vector(positions, corners);
  if (!(max_component(abs(normal)) > 0)) return add_fan();
  const Projection flat(normal);
  if (is_fan(positions, corners, flat)) return add_fan();

  std::vector<std::uint32_t> distinct;
  std::vector<Point> points;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::uint32_t before = corners[i == 0 ? corners.size() - 1 : i - 1];
    if (positions[corners[i]] == positions[before]) continue;
    distinct.push_back(corners[i]);
    points.push_back(flat(positions[corners[i]]));
  }
  Ring(std::move(points), steps).cut([&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    triangles.push_back({distinct[a], distinct[b], distinct[c]});
  });
  return true;
}

}  // namespace tessera::proto
