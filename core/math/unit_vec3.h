#pragma once

#include <optional>

#include "core/math/vec.h"

namespace tessera {

/// A direction of length 1 (to rounding). The only way to get one is to normalise, so a function that takes a
/// `UnitVec3` needs no check of its own.
class UnitVec3 {
 public:
  /// The direction of `v`; nothing when `v` is zero or not finite. Scales first, so that lengths from 1e-38 to
  /// 1e38 neither vanish nor overflow.
  static std::optional<UnitVec3> normalize(Vec3d v) {
    const double scale = max_component(abs(v));
    if (!(scale > 0) || !is_finite(v)) return std::nullopt;
    const Vec3d scaled = v / scale;
    return UnitVec3(to_float(scaled / length(scaled)));
  }
  static std::optional<UnitVec3> normalize(Vec3 v) { return normalize(to_double(v)); }

  static constexpr UnitVec3 x() { return UnitVec3({1, 0, 0}); }
  static constexpr UnitVec3 y() { return UnitVec3({0, 1, 0}); }
  static constexpr UnitVec3 z() { return UnitVec3({0, 0, 1}); }

  constexpr UnitVec3 operator-() const { return UnitVec3(-v_); }
  constexpr operator const Vec3&() const { return v_; }
  constexpr const Vec3& vec() const { return v_; }

 private:
  constexpr explicit UnitVec3(Vec3 v) : v_(v) {}
  Vec3 v_;
};

}  // namespace tessera
