#include "core/math/transform.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

using Rows = std::array<double, 12>;

Vec3d row(const Rows& m, int i) { return {m[i * 4], m[i * 4 + 1], m[i * 4 + 2]}; }
Vec3d column(const Rows& m, int j) { return {m[j], m[4 + j], m[8 + j]}; }

bool is_singular(const Rows& m) {
  const Vec3d a = row(m, 0), b = row(m, 1), c = row(m, 2);
  const double det = dot(a, cross(b, c));
  // Hadamard: |det| ≤ |a||b||c|. A determinant this far below the bound is rounding noise of its own products.
  const double largest = length(a) * length(b) * length(c);
  return !std::isfinite(det) || !(std::abs(det) > 1e-14 * largest);
}

/// Precondition: not singular.
Rows inverse(const Rows& m) {
  const Vec3d a = row(m, 0), b = row(m, 1), c = row(m, 2);
  const Vec3d bc = cross(b, c), ca = cross(c, a), ab = cross(a, b);
  const double det = dot(a, bc);
  const Vec3d x = bc / det, y = ca / det, z = ab / det;  // the columns of the linear inverse
  const Vec3d t = column(m, 3);
  Rows inv{};
  for (int i = 0; i < 3; ++i) {
    inv[i * 4] = x[i];
    inv[i * 4 + 1] = y[i];
    inv[i * 4 + 2] = z[i];
    inv[i * 4 + 3] = -(x[i] * t.x + y[i] * t.y + z[i] * t.z);
  }
  return inv;
}

/// ‖|A|·|B|‖∞ of the linear parts.
double product_norm(const auto& a, const auto& b) {
  double most = 0;
  for (int i = 0; i < 3; ++i) {
    double row = 0;
    for (int k = 0; k < 3; ++k)
      for (int j = 0; j < 3; ++j) row += std::abs(double{a[i * 4 + k]}) * std::abs(double{b[k * 4 + j]});
    most = std::max(most, row);
  }
  return most;
}

}  // namespace

std::optional<Transform> Transform::from_rows(const std::array<double, 12>& rows) {
  if (!std::ranges::all_of(rows, [](double v) { return std::isfinite(v); })) return std::nullopt;
  if (is_singular(rows)) return std::nullopt;
  const Rows exact = inverse(rows);
  Transform out;
  Rows rounded{};
  for (int i = 0; i < 12; ++i) {
    out.world_to_local_[i] = static_cast<float>(exact[i]);
    rounded[i] = out.world_to_local_[i];
    if (!std::isfinite(rounded[i])) return std::nullopt;
  }
  if (is_singular(rounded)) return std::nullopt;
  // By its rounding, and that of `left_by`, a direction is turned by 7√3u·‖|W|·|L|‖ at most; a search takes more than
  // 160u for "runs away".
  out.turns_little_ = product_norm(out.world_to_local_, inverse(rounded)) <= 8;
  return out;
}

std::optional<Transform> composed(const Transform& outer, const Transform& inner) {
  const Rows a = outer.rows(), b = inner.rows();
  std::array<double, 12> rows{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      rows[i * 4 + j] =
          a[i * 4] * b[j] + a[i * 4 + 1] * b[4 + j] + a[i * 4 + 2] * b[8 + j] + (j == 3 ? a[i * 4 + 3] : 0);
  return Transform::from_rows(rows);
}

Ray Transform::to_local(const Ray& world) const {
  const auto& m = world_to_local_;
  const Vec3 o = world.origin, d = world.direction;
  const auto linear = [&](int i, Vec3 v) { return m[i * 4] * v.x + m[i * 4 + 1] * v.y + m[i * 4 + 2] * v.z; };
  Ray local{{linear(0, o) + m[3], linear(1, o) + m[7], linear(2, o) + m[11]},
            {linear(0, d), linear(1, d), linear(2, d)},
            world.t_min,
            world.t_max};
  constexpr float kFarFromDenormal = 0x1p-100F;
  if (turns_little_ && max_component(abs(local.direction)) >= kFarFromDenormal) local.leaves = world.leaves;
  return local;
}

Transform::ToWorld Transform::to_world() const {
  Rows rows;
  std::ranges::copy(world_to_local_, rows.begin());
  return ToWorld(inverse(rows));
}

Vec3d Transform::ToWorld::point(Vec3d p) const {
  const auto& m = rows_;
  return {dot(row(m, 0), p) + m[3], dot(row(m, 1), p) + m[7], dot(row(m, 2), p) + m[11]};
}

Vec3d Transform::normal_to_world(Vec3d n) const {
  const auto& m = world_to_local_;
  return {m[0] * n.x + m[4] * n.y + m[8] * n.z, m[1] * n.x + m[5] * n.y + m[9] * n.z,
          m[2] * n.x + m[6] * n.y + m[10] * n.z};
}

Transform::Error Transform::error() const {
  Error worst;
  const Rows to_world = this->to_world().rows();
  for (int i = 0; i < 3; ++i) {
    double condition = 0, offset = 0;
    for (int k = 0; k < 3; ++k) {
      const double l = std::abs(to_world[i * 4 + k]);
      for (int j = 0; j < 3; ++j) condition += l * std::abs(world_to_local_[k * 4 + j]);
      offset += l * std::abs(world_to_local_[k * 4 + 3]);
    }
    worst.condition = std::max(worst.condition, condition);
    worst.offset = std::max(worst.offset, offset);
  }
  return worst;
}

Vec3d Transform::origin_error(Vec3d origin, const ToWorld& to_world) const {
  const auto& m = world_to_local_;
  Vec3d local;
  for (int k = 0; k < 3; ++k)
    local[k] = std::abs(m[k * 4] * origin.x) + std::abs(m[k * 4 + 1] * origin.y) + std::abs(m[k * 4 + 2] * origin.z) +
               std::abs(double{m[k * 4 + 3]});
  const Rows& l = to_world.rows();
  const double most = 8 * kUnitRoundoff;
  return {most * dot(abs(row(l, 0)), local), most * dot(abs(row(l, 1)), local), most * dot(abs(row(l, 2)), local)};
}

}  // namespace tessera
