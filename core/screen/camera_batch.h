#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/accel/accel.h"
#include "core/math/ray_fan.h"
#include "core/screen/camera_rays.h"

namespace tessera {

/// A camera's rays that are traced together, made once, in the form in which they are traced: directions alone where
/// all leave one point. For one thread at a time: memory is kept from batch to batch.
class CameraBatch {
 public:
  /// The camera has to outlive this.
  explicit CameraBatch(const CameraRays& camera) : camera_(camera) {}

  void clear();

  /// Adds `CameraRays::ray(x, y, lens)`.
  void add(double x, double y, Vec2 lens = {0.5F, 0.5F});

  std::size_t size() const { return rays().size(); }

  /// In the order in which they were added; valid until more are, or none are left.
  RaySpan rays() const;

  /// `Accel::closest` for all of them.
  void closest(const Accel& accel, std::span<Hit> hits, TraceLog log, Candidates among) const;

 private:
  bool is_fan() const { return camera_.is_perspective() && !camera_.has_lens(); }
  RayFan fan() const;

  const CameraRays& camera_;
  std::vector<Ray> rays_;
  Directions directions_;
};

}  // namespace tessera
