#pragma once

#include <cstdint>
#include <vector>

#include "core/accel/accel.h"
#include "core/integrator/integrator.h"
#include "core/integrator/ray_counts.h"
#include "core/integrator/shadow_batch.h"
#include "core/scene/scene.h"

namespace tessera {

/// What camera rays see that meet nothing but the scene's ground: the background, darker by the share of the sky that
/// objects hide there. For one thread at a time.
class GroundShadows {
 public:
  GroundShadows(const Scene& scene, bool has_alpha) : scene_(scene), batch_(scene, has_alpha) {}

  /// A ray that escapes, with what it sees of the background and how much of it has been passed on the way; the numbers
  /// are those of its sample at its last vertex. False where it doesn't meet the ground, and nothing is done.
  bool add(const Ray& ray, Vec2 numbers, Rgb background, float passed, std::uint32_t sum);

  bool empty() const { return shadows_.empty(); }

  /// Adds to the sums what all rays see. Then it is empty.
  void trace(const Accel& accel, Integrator::Output out, RayCounts& counts, TraceLog log);

 private:
  struct Shadow {
    Rgb background;
    float passed;
    std::uint32_t sum;
  };

  const Scene& scene_;
  ShadowBatch batch_;
  std::vector<Shadow> shadows_;
  std::vector<Rgb> open_;  ///< For each, the share of the sky.
};

}  // namespace tessera
