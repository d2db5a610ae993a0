#pragma once

#include <cstdint>

#include "core/math/ray.h"
#include "core/scene/camera.h"

namespace tessera {

/// A camera set up for an image size: makes first-level rays.
class CameraRays {
 public:
  CameraRays(const Camera& camera, std::uint32_t width, std::uint32_t height);

  /// The ray through image position (x, y) in pixels, (0, 0) being the top left corner of the top left pixel.
  /// Its t is metres along the camera's axis (depth), so the direction isn't normalised.
  Ray ray(double x, double y) const;

  /// Where a point is seen, in pixels, and how deep along the axis; the depth is ≤ 0 at and behind the camera's
  /// plane, where x and y mean nothing for a perspective camera.
  struct Projected {
    double x, y, depth;
  };
  Projected project(Vec3d point) const;

  /// How far right of and below the camera's axis a point lies, in metres.
  struct Sideways {
    double x, y;
  };
  Sideways sideways(Vec3d point) const;

  bool is_perspective() const { return perspective_; }
  Vec3 eye() const { return eye_; }
  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }

  /// By how many pixels, at most, the float ray through (x, y) can stray from the exact one, `reach` metres
  /// (max norm) from the camera.
  double stray_pixels(double reach) const;

  /// By how much, at most, in metres along the axis, a ray's float origin can lie off the camera's plane.
  double stray_depth(double reach) const;

 private:
  bool perspective_;
  std::uint32_t width_, height_;
  Vec3 eye_;
  Vec3d right_, down_, forward_;  ///< Orthonormal.
  double pixel_;                  ///< Side of a pixel: on the plane at depth 1, or in metres (orthographic).
};

}  // namespace tessera
