#include "core/screen/camera_rays.h"

#include "core/math/float_environment.h"
#include "core/math/portable.h"

namespace tessera {
namespace {

Vec3d unit(Vec3d v) { return v / max_component(abs(v)) / length(v / max_component(abs(v))); }

}  // namespace

CameraRays::CameraRays(const Camera& camera, std::uint32_t width, std::uint32_t height)
    : perspective_(std::holds_alternative<PerspectiveCamera>(camera)), width_(width), height_(height) {
  const StrictFloats strict;
  const View& view = std::visit([](const auto& c) -> const View& { return c.view; }, camera);
  eye_ = view.from;
  forward_ = unit(to_double(view.at) - to_double(view.from));
  right_ = unit(cross(forward_, to_double(view.up)));
  down_ = cross(forward_, right_);
  const auto* pinhole = std::get_if<PerspectiveCamera>(&camera);
  const double picture_height =
      pinhole ? 2 * portable_tan(pinhole->vertical_fov / 2.0) : double{std::get<OrthographicCamera>(camera).height};
  pixel_ = picture_height / height;
}

Ray CameraRays::ray(double x, double y) const {
  const Vec3d offset = right_ * ((x - width_ / 2.0) * pixel_) + down_ * ((y - height_ / 2.0) * pixel_);
  if (perspective_) return {eye_, to_float(forward_ + offset)};
  return {to_float(to_double(eye_) + offset), to_float(forward_)};
}

CameraRays::Projected CameraRays::project(Vec3d point) const {
  const Vec3d v = point - to_double(eye_);
  const double depth = dot(v, forward_);
  const double scale = pixel_ * (perspective_ ? depth : 1);
  return {dot(v, right_) / scale + width_ / 2.0, dot(v, down_) / scale + height_ / 2.0, depth};
}

CameraRays::Sideways CameraRays::sideways(Vec3d point) const {
  const Vec3d v = point - to_double(eye_);
  return {dot(v, right_), dot(v, down_)};
}

double CameraRays::stray_pixels(double reach) const {
  const double half = 0.5 * pixel_ * width_ + 0.5 * pixel_ * height_;
  // Each float of a ray is off by u of itself. Perspective: the direction's error, at most 2u(1 + half) in length,
  // is seen on the plane at depth 1 enlarged by the direction's own length there. Orthographic: the origin's error,
  // plus the direction's over the way.
  const double stray = perspective_ ? 2 * kUnitRoundoff * (1 + half) * (1 + half)
                                    : 2 * kUnitRoundoff * (max_component(abs(eye_)) + half + 2 * reach);
  return stray / pixel_;
}

double CameraRays::stray_depth(double reach) const {
  // A pinhole's rays all start at the eye itself. The float origin of one of the parallel rays that reach so far is off
  // by u of each coordinate, at most √3·u·(|eye| + 2·reach) in length.
  return perspective_ ? 0 : 2 * kUnitRoundoff * (max_component(abs(to_double(eye_))) + 2 * reach);
}

}  // namespace tessera
