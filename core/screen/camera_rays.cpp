#include "core/screen/camera_rays.h"

#include <algorithm>
#include <cmath>

#include "core/math/float_environment.h"
#include "core/sampling/warp.h"

namespace tessera {
namespace {

Vec3d unit(Vec3d v) { return v / max_component(abs(v)) / length(v / max_component(abs(v))); }

/// How far from a position the farther end of [0, size] is.
double farthest(double position, double size) { return std::max(std::abs(position), std::abs(size - position)); }

}  // namespace

CameraRays::CameraRays(const Camera& camera, std::uint32_t width, std::uint32_t height, double beyond)
    : perspective_(std::holds_alternative<PerspectiveCamera>(camera)), width_(width), height_(height), beyond_(beyond) {
  const StrictFloats strict;
  const View& view = std::visit([](const auto& c) -> const View& { return c.view; }, camera);
  clipping_ = std::visit([](const auto& c) { return c.clipping; }, camera);
  eye_ = view.from;
  forward_ = unit(to_double(view.at) - to_double(view.from));
  right_ = unit(cross(forward_, to_double(view.up)));
  down_ = cross(forward_, right_);
  film_ = std::visit([&](const auto& c) { return film_plane(c, width, height); }, camera);
  half_ = (farthest(film_.axis_x, width) + beyond) * film_.pixel_x +
          (farthest(film_.axis_y, height) + beyond) * film_.pixel_y;
  if (const auto* pinhole = std::get_if<PerspectiveCamera>(&camera)) lens_ = pinhole->lens;
  if (!has_lens()) return;
  // A ray's origin is off by 2.1u of the radius, as the disk's point is rounded, and by u of each of its own
  // coordinates: in length, by less than 4u·(|eye| + radius). The ray's line crosses the camera's plane as much farther
  // out, and again so much for each metre that it leads sideways while it gets one ahead: at most 8/7 of half +
  // (radius + off) / focus. Where `off` is larger the direction, whose part along the axis is 1 - off / focus at least,
  // may be any.
  const double off = 4 * kUnitRoundoff * (max_component(abs(to_double(eye_))) + lens_.radius);
  lens_reach_ = off > lens_.focus_distance / 8.0
                    ? kInfinity
                    : lens_.radius + off * (1 + 2 * (half_ + (lens_.radius + off) / lens_.focus_distance));
}

Ray CameraRays::ray(double x, double y, Vec2 lens) const {
  const Vec3d offset = right_ * ((x - film_.axis_x) * film_.pixel_x) + down_ * ((y - film_.axis_y) * film_.pixel_y);
  const auto [near, far] = clipping_;
  if (!perspective_) return {to_float(to_double(eye_) + offset), to_float(forward_), near, far};
  if (!has_lens()) return {eye_, to_float(forward_ + offset), near, far};
  const Vec2 at = uniform_disk(lens);
  const Vec3d on_lens = (right_ * double{at.x} + down_ * double{at.y}) * double{lens_.radius};
  const Vec3 origin = to_float(to_double(eye_) + on_lens);
  // From the origin as it is rounded, so that this doesn't blur what is in focus.
  const Vec3d aside = to_double(origin) - to_double(eye_);
  return {origin, to_float(forward_ + offset - aside / lens_.focus_distance), near, far};
}

CameraRays::Projected CameraRays::project(Vec3d point) const {
  const Vec3d v = point - to_double(eye_);
  const double depth = dot(v, forward_), scale = perspective_ ? depth : 1;
  return {dot(v, right_) / (film_.pixel_x * scale) + film_.axis_x,
          dot(v, down_) / (film_.pixel_y * scale) + film_.axis_y, depth};
}

CameraRays::Sideways CameraRays::sideways(Vec3d point) const {
  const Vec3d v = point - to_double(eye_);
  return {dot(v, right_), dot(v, down_)};
}

CameraRays::Shift CameraRays::stray(double reach) const {
  // Each float of a ray is off by u of itself. Perspective: the direction's error, at most 2u(1 + half) in length, is
  // seen on the plane at depth 1 enlarged by the direction's own length there; a lens adds its reach / focus to half.
  // Orthographic: the origin's error, plus the direction's over the way.
  const double longest = 1 + half_ + (has_lens() ? lens_reach_ / lens_.focus_distance : 0);
  const double stray = perspective_ ? 2 * kUnitRoundoff * longest * longest
                                    : 2 * kUnitRoundoff * (max_component(abs(eye_)) + half_ + 2 * reach);
  return {stray / film_.pixel_x, stray / film_.pixel_y};
}

CameraRays::Shift CameraRays::blur(double depth) const {
  if (!has_lens()) return {0, 0};
  // By the theorem of intersecting lines. From a place s beside the middle, the point is seen over one of the plane in
  // focus that lies s · (1 − focus / depth) beside the one it is seen over from the middle; at depth 1, where pixels
  // are measured, that is s · (1 / focus − 1 / depth).
  const double blur = lens_reach_ * std::abs(1 / double{lens_.focus_distance} - 1 / depth);
  return {blur / film_.pixel_x, blur / film_.pixel_y};
}

double CameraRays::stray_depth(double reach) const {
  // A pinhole's rays all start at the eye itself. The float origin of one of the parallel rays that reach so far is off
  // by u of each coordinate, at most √3·u·(|eye| + 2·reach) in length; that of a lens's, within reach of the eye, less.
  if (perspective_ && !has_lens()) return 0;
  return 2 * kUnitRoundoff * (max_component(abs(to_double(eye_))) + 2 * reach);
}

}  // namespace tessera
