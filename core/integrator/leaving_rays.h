#pragma once

#include <optional>

#include "core/accel/accel.h"
#include "core/integrator/ray_counts.h"
#include "core/integrator/shading.h"
#include "core/integrator/shadow_batch.h"
#include "core/math/ray.h"
#include "core/scene/scene.h"

namespace tessera {

/// Starts rays at surfaces as their smooth normals have it. For one thread at a time.
class LeavingRays {
 public:
  /// `has_alpha`: as `ShadowBatch` takes it. `accel` may be null where nothing is ever hit.
  LeavingRays(const Scene& scene, bool has_alpha, const Accel* accel, RayCounts& counts, TraceLog log)
      : accel_(accel), counts_(counts), log_(log), between_(scene, has_alpha) {}

  struct Leaving {
    Ray ray;
    float share = 1;  ///< What surfaces that aren't all there let pass on the way to the ray's start.
  };

  /// A ray from a hit of `primitive` on, `origin` being where rays start on the viewer's side; nothing where a
  /// direction (unit) of the smooth surface leads to the wrong side of the face. A direction that is beneath the face
  /// and above the smooth surface starts there, unless something lies in between (after Hanika, Hacking the Shadow
  /// Terminator, Ray Tracing Gems II, 2021).
  std::optional<Leaving> find(const Shading& at, PrimitiveId primitive, Vec3 origin, Vec3 direction, bool reflects);

 private:
  const Accel* accel_;
  RayCounts& counts_;
  TraceLog log_;
  ShadowBatch between_;
};

}  // namespace tessera
