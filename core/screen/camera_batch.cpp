#include "core/screen/camera_batch.h"

namespace tessera {

void CameraBatch::clear() {
  rays_.clear();
  directions_.clear();
}

void CameraBatch::add(double x, double y, Vec2 lens) {
  const Ray ray = camera_.ray(x, y, lens);
  if (is_fan())
    directions_.push_back(ray.direction);
  else
    rays_.push_back(ray);
}

RayFan CameraBatch::fan() const {
  RayFan fan(camera_.eye(), directions_);
  fan.t_min = camera_.clipping().near;
  fan.t_max = camera_.clipping().far;
  return fan;
}

RaySpan CameraBatch::rays() const { return is_fan() ? RaySpan(fan()) : RaySpan(rays_); }

void CameraBatch::closest(const Accel& accel, std::span<Hit> hits, TraceLog log, Candidates among) const {
  if (is_fan())
    accel.closest_fan(fan(), hits, log, among);
  else
    accel.closest(rays_, hits, log, among);
}

}  // namespace tessera
