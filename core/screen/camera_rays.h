#pragma once

#include <cstdint>

#include "core/math/ray.h"
#include "core/math/vec2.h"
#include "core/scene/camera.h"
#include "core/scene/film_plane.h"

namespace tessera {

/// A camera set up for an image size: makes first-level rays, and says how far they may be from where they should be.
class CameraRays {
 public:
  /// Samples may fall up to `beyond` pixels outside their own pixel (`PixelFilter`): who asks for areas has to say so.
  CameraRays(const Camera& camera, std::uint32_t width, std::uint32_t height, double beyond = 0);

  /// The ray through image position (x, y) in pixels, (0, 0) being the top left corner of the top left pixel, that
  /// leaves the lens, if there is one, at `uniform_disk(lens)`; by default in the middle. Its t is metres along the
  /// camera's axis (depth), so the direction isn't normalised. All rays of a position meet at the lens's focus
  /// distance.
  Ray ray(double x, double y, Vec2 lens = {0.5F, 0.5F}) const;

  /// Where a point is seen from the lens's middle, in pixels, and how deep along the axis; the depth is ≤ 0 at and
  /// behind the camera's plane, where x and y mean nothing for a perspective camera.
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
  bool has_lens() const { return lens_.radius > 0; }
  Vec3 eye() const { return eye_; }
  Clipping clipping() const { return clipping_; }
  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }

  /// How far outside their own pixel samples may fall, in pixels.
  double beyond() const { return beyond_; }

  /// Pixels across and down.
  struct Shift {
    double x, y;
  };

  /// By how much, at most, the float ray through a sample can stray from the exact one, `reach` metres (max norm) from
  /// the camera.
  Shift stray(double reach) const;

  /// How far, at most, a point at that depth (> 0) is seen, from elsewhere on the lens, from where the middle sees it.
  Shift blur(double depth) const;

  /// How far from the eye, at most, rays cross the camera's plane if it has a lens, in metres; otherwise 0. Infinite
  /// where floats are too coarse to say where on the lens a ray starts, and so where it leads.
  double lens_reach() const { return lens_reach_; }

  /// By how much, at most, in metres along the axis, a ray's float origin can lie off the camera's plane.
  double stray_depth(double reach) const;

 private:
  bool perspective_;
  std::uint32_t width_, height_;
  double beyond_;
  Vec3 eye_;
  Vec3d right_, down_, forward_;  ///< Orthonormal.
  FilmPlane film_;
  double half_;  ///< How far from the axis samples are, |x| + |y|: in `FilmPlane`'s metres.
  Lens lens_{};
  double lens_reach_ = 0;
  Clipping clipping_;
};

}  // namespace tessera
