#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <tuple>
#include <variant>
#include <vector>

#include "core/scene/scene.h"
#include "tests/support/quadric_oracle.h"

namespace tessera {

// What a ray meets, decided without the code under test: triangles exactly, quadrics in long double.

/// A sum of doubles that don't overlap, the greatest last: exact as long as nothing under- or overflows, i.e. for
/// products of three floats and their differences (Shewchuk 1997, "Adaptive Precision Floating-Point Arithmetic").
class ExactSum {
 public:
  void add(double value) {
    std::size_t kept = 0;
    for (const double part : parts_) {
      const double sum = value + part, back = sum - value, lost = (value - (sum - back)) + (part - back);
      if (lost != 0) parts_[kept++] = lost;
      value = sum;
    }
    parts_.resize(kept);
    if (value != 0) parts_.push_back(value);
  }
  /// To 2^-63 of it; its sign exact.
  Wide value() const {
    Wide sum = 0;
    for (const double part : parts_) sum += part;
    return sum;
  }

 private:
  std::vector<double> parts_;
};

/// As the cross product, but with sums for differences.
inline Vec3w mixed(Vec3w a, Vec3w b) { return {a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x}; }

/// u · (v × w) of differences of floats: to 2^-36 of it, and its sign is exact.
inline Wide determinant(std::array<Vec3, 2> u, std::array<Vec3, 2> v, std::array<Vec3, 2> w) {
  const Vec3w a = widen(u[1]) - widen(u[0]), b = widen(v[1]) - widen(v[0]), c = widen(w[1]) - widen(w[0]);
  // Ten roundings of 2^-64 at most on the way to each of the six products.
  const Wide quick = dot(a, cross(b, c)), permanent = dot(abs(a), mixed(abs(b), abs(c)));
  if (std::abs(quick) > permanent * 0x1p-24L) return quick;
  constexpr int kEven[3][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}};
  ExactSum sum;
  for (const auto& [i, j, k] : kEven)
    for (unsigned ends = 0; ends < 8; ++ends) {
      const Vec3 &p = u[ends & 1], &q = v[ends >> 1 & 1], &r = w[ends >> 2];
      const double sign = std::popcount(ends) % 2 == 1 ? 1 : -1;
      for (const auto& [m, n, s] : {std::tuple{j, k, sign}, std::tuple{k, j, -sign}}) {
        const double two = s * p[i] * q[m], three = two * r[n];  // the first is exact
        sum.add(three);
        sum.add(std::fma(two, r[n], -three));
      }
    }
  return sum.value();
}

struct WideHit {
  Wide t = 0;
  std::uint32_t object = 0, primitive = 0;
  Wide steepness = 1;  ///< As in `ExactCrossing`.

  auto operator<=>(const WideHit&) const = default;
};

struct WideAnswer {
  std::vector<WideHit> hits;  ///< The first of each primitive in the ray's open interval, ordered by (t, identity).
  /// How far (metres) the ray passes from the nearest edge, rim or silhouette, where hit turns into miss.
  Wide margin = std::numeric_limits<Wide>::infinity();

  std::optional<WideHit> closest() const { return hits.empty() ? std::nullopt : std::optional(hits.front()); }
};

/// A triangle by the signs of three exact determinants, edges and corners inside; of no area, or seen edge-on, missed.
inline Crossings crossings(const std::array<Vec3, 3>& corners, const Ray& ray) {
  const std::array<Vec3, 2> d{Vec3{}, ray.direction};
  const auto& [a, b, c] = corners;
  const Vec3 o = ray.origin;
  const std::array<Wide, 3> weights{determinant(d, {o, c}, {o, b}), determinant(d, {o, a}, {o, c}),
                                    determinant(d, {o, b}, {o, a})};
  const auto& [wa, wb, wc] = weights;
  const Wide length_d = std::sqrt(dot(widen(ray.direction), widen(ray.direction)));
  Crossings out{{}, std::numeric_limits<Wide>::infinity()};
  for (int i = 0; i < 3; ++i) {
    // |w| / (|d| · |edge across the ray|) is how far the ray passes from the edge's line.
    const Vec3w from = widen(corners[static_cast<std::size_t>(i)]),
                to = widen(corners[static_cast<std::size_t>((i + 1) % 3)]);
    const Vec3w across = cross(to - from, widen(ray.direction));
    const Wide edge = std::sqrt(dot(across, across)) / length_d;
    const Wide w = std::abs(weights[static_cast<std::size_t>((i + 2) % 3)]);
    out.margin = std::min(out.margin, edge > 0 ? w / (length_d * edge) : 0);
  }
  const bool inside = (wa >= 0 && wb >= 0 && wc >= 0) || (wa <= 0 && wb <= 0 && wc <= 0);
  const Wide volume = determinant(d, {a, b}, {a, c});
  if (!inside || volume == 0) return out;
  const Wide t = determinant({o, a}, {a, b}, {a, c}) / volume;
  const Vec3w n = cross(widen(b) - widen(a), widen(c) - widen(a));
  out.all = {{t, std::abs(dot(n, widen(ray.direction))) / (std::sqrt(dot(n, n)) * length_d)}};
  return out;
}

/// All that the ray meets. An instance's ray is what `Transform::to_local` makes of it: that rounding is part of what
/// an instance is.
inline WideAnswer wide_trace(const Scene& scene, const Ray& world) {
  WideAnswer out;
  for (std::uint32_t object = 0; object < scene.objects.size(); ++object) {
    const Object& o = scene.objects[object];
    const Ray ray = o.placement ? o.placement->to_local(world) : world;
    const auto take = [&](const Crossings& found, std::uint32_t primitive) {
      out.margin = std::min(out.margin, found.margin);
      const auto first = std::ranges::find_if(found.all, [&](const ExactCrossing& c) { return c.t > ray.t_min; });
      if (first != found.all.end() && first->t < ray.t_max)
        out.hits.push_back({first->t, object, primitive, first->steepness});
    };
    std::visit(
        [&](const auto& shape) {
          using S = std::decay_t<decltype(shape)>;
          if constexpr (std::is_same_v<S, TriangleMesh>) {
            for (std::uint32_t i = 0; i < shape.triangles.size(); ++i) {
              const auto& [a, b, c] = shape.triangles[i];
              take(crossings(std::array{shape.positions[a], shape.positions[b], shape.positions[c]}, ray), i);
            }
          } else if constexpr (std::is_same_v<S, Quad>) {
            const auto& [a, b, c, d] = shape.corners;
            Crossings both = crossings(std::array{a, b, c}, ray), second = crossings(std::array{a, c, d}, ray);
            both.all.insert(both.all.end(), second.all.begin(), second.all.end());
            std::ranges::sort(both.all, {}, &ExactCrossing::t);
            both.margin = std::min(both.margin, second.margin);
            take(both, 0);
          } else {
            take(crossings(shape, ray), 0);
          }
        },
        scene.shapes[o.shape]);
  }
  std::ranges::sort(out.hits);
  return out;
}

}  // namespace tessera
