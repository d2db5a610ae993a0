#pragma once

#include <stop_token>
#include <utility>

#include "core/accel/accel.h"
#include "core/integrator/ray_counts.h"
#include "core/math/rgb.h"
#include "core/scene/scene.h"

namespace tessera {

struct Shading;

/// Whitted's recursive ray tracer (CACM 1980): at each hit, every light that the surface faces and that nothing
/// hides; then, where the material asks for them, the mirrored and the refracted ray, down to `max_depth` rays in a
/// chain. A ray that hits nothing brings the background.
class Whitted {
 public:
  /// `log` is told what is tested. Once `stop` is requested no further ray is traced, and what
  /// comes back means nothing.
  Whitted(const Scene& scene, const Accel& accel, std::uint32_t max_depth, RayCounts& counts, TraceLog log = {},
          std::stop_token stop = {})
      : scene_(scene), accel_(accel), max_depth_(max_depth), counts_(counts), log_(log), stop_(std::move(stop)) {}

  /// Radiance that arrives along `ray` (W/(sr m²)), given what it hits; `depth` counts the rays of the chain, the
  /// camera's being 1.
  Rgb radiance(const Ray& ray, const std::optional<Hit>& hit, std::uint32_t depth = 1);

 private:
  Rgb direct(const Material& material, const Shading& at);
  /// What a ray spawned at a hit of depth `depth` brings back.
  Rgb follow(Vec3 origin, Vec3 direction, std::uint32_t depth);

  const Scene& scene_;
  const Accel& accel_;
  std::uint32_t max_depth_;
  RayCounts& counts_;
  TraceLog log_;
  std::stop_token stop_;
};

}  // namespace tessera
