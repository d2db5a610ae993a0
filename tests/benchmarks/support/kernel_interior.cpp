#include "tests/benchmarks/support/kernel_interior.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/benchmarks/support/kernel_meshes.h"
#include "tests/support/meshes.h"
#include "tests/support/random.h"

namespace tessera::bench {
namespace {

// Metres: x along the row, y up, z across.
constexpr int kRooms = 6;
constexpr double kRoomLength = 8, kWidth = 6, kHeight = 3.6, kLength = kRooms * kRoomLength;

/// A ring of a body of revolution.
struct Ring {
  double radius, height;
};

class InteriorBuilder {
 public:
  void quad(Vec3d a, Vec3d b, Vec3d c, Vec3d d) {
    const auto i = static_cast<std::uint32_t>(mesh_.positions.size());
    for (const Vec3d p : {a, b, c, d}) mesh_.positions.push_back(to_float(p));
    mesh_.triangles.push_back({i, i + 1, i + 2});
    mesh_.triangles.push_back({i, i + 2, i + 3});
  }

  void box(Vec3d lo, Vec3d hi) {
    quad({lo.x, lo.y, lo.z}, {lo.x, lo.y, hi.z}, {lo.x, hi.y, hi.z}, {lo.x, hi.y, lo.z});
    quad({hi.x, lo.y, hi.z}, {hi.x, lo.y, lo.z}, {hi.x, hi.y, lo.z}, {hi.x, hi.y, hi.z});
    quad({lo.x, lo.y, lo.z}, {hi.x, lo.y, lo.z}, {hi.x, lo.y, hi.z}, {lo.x, lo.y, hi.z});
    quad({lo.x, hi.y, hi.z}, {hi.x, hi.y, hi.z}, {hi.x, hi.y, lo.z}, {lo.x, hi.y, lo.z});
    quad({hi.x, lo.y, lo.z}, {lo.x, lo.y, lo.z}, {lo.x, hi.y, lo.z}, {hi.x, hi.y, lo.z});
    quad({lo.x, lo.y, hi.z}, {hi.x, lo.y, hi.z}, {hi.x, hi.y, hi.z}, {lo.x, hi.y, hi.z});
  }

  /// A body of revolution about the vertical through `foot`.
  void turned(Vec3d foot, const std::vector<Ring>& rings, int segments) {
    const auto at = [&](const Ring& ring, int segment) {
      const double angle = 2 * std::numbers::pi * segment / segments;
      return foot + Vec3d{ring.radius * std::cos(angle), ring.height, ring.radius * std::sin(angle)};
    };
    for (std::size_t i = 0; i + 1 < rings.size(); ++i)
      for (int s = 0; s < segments; ++s)
        quad(at(rings[i], s + 1), at(rings[i], s), at(rings[i + 1], s), at(rings[i + 1], s + 1));
  }

  /// A wall across the row with an arched way through it.
  void arched_wall(double x, double thickness) {
    constexpr double kRadius = 1.1, kSpring = 2, kMiddle = kWidth / 2;
    constexpr int kSegments = 32;
    const double back = x + thickness;
    box({x, 0, 0}, {back, kHeight, kMiddle - kRadius});
    box({x, 0, kMiddle + kRadius}, {back, kHeight, kWidth});
    const auto arch = [&](int segment, double at_x) {
      const double angle = std::numbers::pi * segment / kSegments;
      return Vec3d{at_x, kSpring + kRadius * std::sin(angle), kMiddle - kRadius * std::cos(angle)};
    };
    const auto above = [](Vec3d p) { return Vec3d{p.x, kHeight, p.z}; };
    for (int s = 0; s < kSegments; ++s) {
      quad(arch(s, x), arch(s + 1, x), above(arch(s + 1, x)), above(arch(s, x)));
      quad(arch(s + 1, back), arch(s, back), above(arch(s, back)), above(arch(s + 1, back)));
      quad(arch(s, x), arch(s, back), arch(s + 1, back), arch(s + 1, x));
    }
  }

  void table(Vec3d at, Vec3d size, double leg) {
    box(at + Vec3d{0, size.y - leg, 0}, at + size);
    for (const double x : {0.0, size.x - leg})
      for (const double z : {0.0, size.z - leg}) box(at + Vec3d{x, 0, z}, at + Vec3d{x + leg, size.y - leg, z + leg});
  }

  /// Four legs and a seat, and slats on one side of it.
  void chair(Vec3d at) {
    table(at, {0.45, 0.45, 0.45}, 0.04);
    for (int i = 0; i < 5; ++i) box(at + Vec3d{0.1 * i, 0.45, 0}, at + Vec3d{0.1 * i + 0.05, 1, 0.03});
    box(at + Vec3d{0, 1, 0}, at + Vec3d{0.45, 1.05, 0.04});
  }

  void shelf(Vec3d at, double length) {
    for (int board = 0; board < 5; ++board) {
      const Vec3d left = at + Vec3d{0, 0.1 + 0.45 * board, 0};
      box(left, left + Vec3d{length, 0.03, 0.3});
      for (double x = 0; x < length - 0.08;) {
        const double thickness = random_.uniform(0.02, 0.08);
        box(left + Vec3d{x, 0.03, 0.02}, left + Vec3d{x + thickness, random_.uniform(0.25, 0.4), 0.25});
        x += thickness + 0.002;
      }
    }
  }

  void vase(Vec3d foot) {
    std::vector<Ring> rings;
    for (int i = 0; i <= 20; ++i) rings.push_back({0.09 + 0.05 * std::sin(0.35 * i) + 0.01 * (i % 2), 0.02 * i});
    turned(foot, rings, 32);
  }

  void lamp(Vec3d at) {
    append(mesh_, icosphere(2), 0.15, at);
    box(at + Vec3d{-0.01, 0.15, -0.01}, {at.x + 0.01, kHeight, at.z + 0.01});
  }

  TriangleMesh take() { return std::move(mesh_); }

 private:
  TriangleMesh mesh_;
  Random random_{1};
};

/// What runs through all rooms.
void add_shell(InteriorBuilder& b) {
  b.quad({0, 0, kWidth}, {kLength, 0, kWidth}, {kLength, 0, 0}, {0, 0, 0});
  b.quad({0, kHeight, 0}, {kLength, kHeight, 0}, {kLength, kHeight, kWidth}, {0, kHeight, kWidth});
  b.box({-0.3, 0, -0.3}, {kLength + 0.3, kHeight, 0});
  b.box({-0.3, 0, kWidth}, {kLength + 0.3, kHeight, kWidth + 0.3});
  b.box({-0.3, 0, 0}, {0, kHeight, kWidth});
  b.box({kLength, 0, 0}, {kLength + 0.3, kHeight, kWidth});
  for (const double z : {0.0, kWidth - 0.03}) b.box({0, 0, z}, {kLength, 0.12, z + 0.03});                 // skirting
  for (const double z : {1.5, 3.0, 4.5}) b.box({0, kHeight - 0.2, z - 0.1}, {kLength, kHeight, z + 0.1});  // beams
  for (double x = 0.5; x < kLength; ++x) b.box({x, kHeight - 0.1, 0}, {x + 0.08, kHeight, kWidth});
}

void furnish(InteriorBuilder& b, double x) {
  const std::vector<Ring> column = {{0.3, 0},    {0.3, 0.15},  {0.24, 0.2}, {0.27, 0.25}, {0.2, 0.3},
                                    {0.17, 3.1}, {0.22, 3.15}, {0.2, 3.2},  {0.3, 3.35},  {0.3, kHeight}};
  for (const double along : {1.0, 7.0})
    for (const double z : {0.5, kWidth - 0.5}) b.turned({x + along, 0, z}, column, 32);
  b.table({x + 3, 0, 1.2}, {2, 0.75, 0.9}, 0.06);
  for (const double along : {3.2, 4.2}) b.chair({x + along, 0, 2.2});
  for (const double along : {3.2, 4.2}) b.chair({x + along, 0, 0.6});
  for (const double along : {3.5, 4.4}) b.vase({x + along, 0.75, 1.6});
  b.shelf({x + 2.5, 0, kWidth - 0.4}, 3);
  for (const double along : {2.7, 5.3}) b.lamp({x + along, 2.9, 3.7});
}

/// By 30° about the vertical.
Vec3 turn(Vec3d p) {
  constexpr double kCos = std::numbers::sqrt3 / 2, kSin = 0.5;
  return to_float({kCos * p.x + kSin * p.z, p.y, kCos * p.z - kSin * p.x});
}

}  // namespace

Interior interior() {
  InteriorBuilder b;
  add_shell(b);
  for (int room = 0; room < kRooms; ++room) {
    if (room > 0) b.arched_wall(kRoomLength * room - 0.15, 0.3);
    furnish(b, kRoomLength * room);
  }
  Interior out{b.take(), {{turn({0.6, 1.8, 2}), turn({20, 1.3, 3.2}), {0, 1, 0}}, 1.1F}, turn({12, 3.1, 3.5})};
  for (Vec3& p : out.mesh.positions) p = turn(to_double(p));
  return out;
}

}  // namespace tessera::bench
