#pragma once

#include <array>
#include <optional>

#include "core/math/ray.h"
#include "core/math/unit_vec3.h"

namespace tessera {

/// An affine map from an object's space to the world.
///
/// Rays are traced in object space, so the float world-to-local matrix is the placement's one definition;
/// local-to-world is the (double) inverse of that float matrix, not the matrix the user wrote.
class Transform {
 public:
  /// Row-major 3x4, local to world. Nothing when a number isn't finite or the matrix is singular, i.e. its
  /// determinant is within rounding of zero for rows of that size, or the inverse overflows a float.
  static std::optional<Transform> from_rows(const std::array<double, 12>& rows);

  /// What places something in `inner`, and that in `outer`. Nothing as above.
  friend std::optional<Transform> composed(const Transform& outer, const Transform& inner);

  /// The ray seen from object space, with the same `t` for the same point: the direction is not normalised. What it
  /// leaves is forgotten where the direction's rounding might turn it back by more than a few roundings.
  Ray to_local(const Ray& world) const;

  /// The map to the world, as traced. It isn't kept, since scenes may have millions of placements: who needs it more
  /// than once had better keep it.
  class ToWorld {
   public:
    Vec3d point(Vec3d local) const;
    /// Row-major 3x4.
    const std::array<double, 12>& rows() const { return rows_; }

   private:
    friend class Transform;
    explicit ToWorld(const std::array<double, 12>& rows) : rows_(rows) {}
    std::array<double, 12> rows_;
  };
  ToWorld to_world() const;

  Vec3d point_to_world(Vec3d local) const { return to_world().point(local); }
  std::array<double, 12> rows() const { return to_world().rows(); }

  /// A normal, by the inverse transpose; mirrored maps keep outward normals outward. Not normalised.
  Vec3d normal_to_world(Vec3d local) const;

  /// All that a transform is, for making the same one elsewhere.
  struct Kept {
    std::array<float, 12> world_to_local{};
    bool turns_little = false;
  };
  Kept kept() const { return {world_to_local_, turns_little_}; }
  /// Precondition: that of a transform.
  static Transform from_kept(const Kept& kept) {
    Transform transform;
    transform.world_to_local_ = kept.world_to_local;
    transform.turns_little_ = kept.turns_little;
    return transform;
  }

  /// Bounds the rounding of `to_local`, seen in world space: with O = |ray origin|∞ and R = the distance∞ from it
  /// to the farthest point that counts, error ≤ 8u · (condition · (O + R) + offset). (Three products and three sums
  /// round 4 times at most, γ4 ≤ 8u; an error e in local space is at most |L|·e in the world.)
  struct Error {
    double condition = 0;  ///< ‖|L|·|W|‖∞ for the linear parts L (local to world) and W (world to local).
    double offset = 0;     ///< ‖|L|·|w|‖∞ for the translation w of world to local.
  };
  Error error() const;

  /// The same for a ray's origin alone, and along each axis.
  Vec3d origin_error(Vec3d origin, const ToWorld& to_world) const;

 private:
  Transform() = default;
  std::array<float, 12> world_to_local_{};
  bool turns_little_ = false;  ///< ‖|W|·|L|‖∞ is small.
};

}  // namespace tessera
