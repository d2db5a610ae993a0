#include "core/screen/screen_rect.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tessera {
namespace {

struct Range {
  double lo = std::numeric_limits<double>::infinity();
  double hi = -std::numeric_limits<double>::infinity();
  void add(double v, double doubt) {
    lo = std::min(lo, v - doubt);
    hi = std::max(hi, v + doubt);
  }
  /// A point on the camera's own plane is seen infinitely far out, on the side where it lies; on both when it is
  /// too near the axis to tell.
  void add_infinitely_far(double side, double doubt) {
    if (side > -doubt) hi = std::numeric_limits<double>::infinity();
    if (side < doubt) lo = -std::numeric_limits<double>::infinity();
  }
};

std::int32_t clamp_to_pixels(double v, std::uint32_t size) {
  return static_cast<std::int32_t>(std::clamp(v, 0.0, static_cast<double>(size)));
}

}  // namespace

PixelRect screen_rect(const Aabb& box, const CameraRays& camera, Transform::Error placed) {
  if (box.empty()) return {};
  const auto width = static_cast<std::int32_t>(camera.width()), height = static_cast<std::int32_t>(camera.height());
  const PixelRect whole{0, 0, width, height};
  if (camera.lens_reach() == kInfinity) return whole;
  const Vec3d eye = to_double(camera.eye());
  const double reach =
      std::max(max_component(abs(to_double(box.lo) - eye)), max_component(abs(to_double(box.hi) - eye))) +
      camera.lens_reach();
  // O + R of `Transform::Error`. A pinhole's rays start at the eye, a lens's so near that `reach` holds their own. A
  // parallel ray that can hit the box starts within 2·reach of the eye, where the box's shadow on the camera's plane
  // lies, so its own reach is at most 3·reach.
  const double from_origin = max_component(abs(eye)) + camera.lens_reach() + (camera.is_perspective() ? 1 : 5) * reach;
  const double pad = 8 * kUnitRoundoff * (placed.condition * from_origin + placed.offset) + reach * 0x1p-30;
  const Vec3d lo = to_double(box.lo) - Vec3d{pad, pad, pad}, hi = to_double(box.hi) + Vec3d{pad, pad, pad};

  // A hit may lie 2^-30·M beside its primitive (core/geometry/double_root.h); a parallel ray's float origin may lie
  // behind the camera's plane. What lies nearer to that plane than this is on it.
  const double plane = reach * 0x1p-30 + camera.stray_depth(reach);
  std::array<Vec3d, 8> corners;
  std::array<CameraRays::Projected, 8> seen;
  Range x, y;
  bool any_in_front = false, any_behind = false;
  for (int i = 0; i < 8; ++i) {
    corners[i] = {i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z};
    seen[i] = camera.project(corners[i]);
    const bool in_front = seen[i].depth > plane;
    any_in_front |= in_front;
    any_behind |= !in_front;
    if (in_front || !camera.is_perspective()) {
      // Each place on the lens sees the box within its corners (and what is in front of the camera's plane, within the
      // corners and what is infinitely far): so all do within what all of them see of each corner.
      const auto blur = camera.blur(seen[i].depth);
      x.add(seen[i].x, blur.x);
      y.add(seen[i].y, blur.y);
    }
  }
  const bool touches_plane = std::ranges::any_of(seen, [&](const auto& s) { return std::abs(s.depth) <= plane; });
  if (!any_in_front && !touches_plane) return {};
  if (camera.is_perspective() && !any_in_front) return whole;

  if (camera.is_perspective() && any_behind)
    for (int i = 0; i < 8; ++i)
      for (const int bit : {1, 2, 4}) {
        const int j = i ^ bit;
        if (seen[i].depth > plane && seen[j].depth <= plane) {
          const double share = seen[i].depth / (seen[i].depth - seen[j].depth);
          const auto side = camera.sideways(corners[i] + (corners[j] - corners[i]) * share);
          x.add_infinitely_far(side.x, plane + camera.lens_reach());
          y.add_infinitely_far(side.y, plane + camera.lens_reach());
        }
      }

  // Dwarfs the rounding of the projection itself, which is in double.
  const auto [stray_x, stray_y] = camera.stray(reach);
  const double more_x = stray_x + camera.beyond(), more_y = stray_y + camera.beyond();
  const PixelRect rect{clamp_to_pixels(std::floor(x.lo - more_x), camera.width()),
                       clamp_to_pixels(std::floor(y.lo - more_y), camera.height()),
                       clamp_to_pixels(std::floor(x.hi + more_x) + 1, camera.width()),
                       clamp_to_pixels(std::floor(y.hi + more_y) + 1, camera.height())};
  return rect.empty() ? PixelRect{} : rect;
}

}  // namespace tessera
