#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "core/render/render.h"

namespace tessera::bench {

enum class RayKind { camera, shadow, reflection, refraction };
inline constexpr std::array kRayKinds = {RayKind::camera, RayKind::shadow, RayKind::reflection, RayKind::refraction};
std::string_view name(RayKind kind);

/// The rays of a render, in the order in which it traces them.
class RecordedRays {
 public:
  std::vector<Ray>& of(RayKind kind) { return rays_[static_cast<std::size_t>(kind)]; }
  std::span<const Ray> of(RayKind kind) const { return rays_[static_cast<std::size_t>(kind)]; }

 private:
  std::array<std::vector<Ray>, kRayKinds.size()> rays_;
};

/// Renders on one thread and keeps every ray. Tiles that the plan skips bring none.
RecordedRays record_rays(const RenderContext& context);

/// Million rays a second on one thread: `occluded` for shadow rays, `closest` for the others. The batch is repeated
/// until at least 20 ms have passed. Precondition: `rays` isn't empty.
double trace_speed(const Accel& accel, RayKind kind, std::span<const Ray> rays);

}  // namespace tessera::bench
