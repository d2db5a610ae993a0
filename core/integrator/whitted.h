#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <stop_token>
#include <vector>

#include "core/accel/accel.h"
#include "core/integrator/direct_light.h"
#include "core/integrator/ray_counts.h"
#include "core/math/rgb.h"
#include "core/scene/scene.h"

namespace tessera {

struct Shading;

/// Whitted's ray tracer (CACM 1980): at each hit, every light that the surface faces and that nothing hides; then,
/// where the material asks for them, the mirrored and the refracted ray, down to `max_depth` rays in a chain. A ray
/// that hits nothing brings the background.
///
/// Rays go in batches: what the hits of one batch ask for is traced together. Each ray's radiance is summed in the
/// same order whatever batch it is in. For one thread: memory is kept from batch to batch.
class Whitted {
 public:
  /// `log` is told what is tested. Once `stop` is requested no further batch is traced, and what comes back means
  /// nothing.
  Whitted(const Scene& scene, const Accel& accel, std::uint32_t max_depth, RayCounts& counts, TraceLog log = {},
          std::stop_token stop = {});

  /// Radiance that arrives along each ray (W/(sr m²)), given what it hits; `t` is infinite where that is nothing. Spans
  /// are of one length.
  void radiance(std::span<const Ray> rays, std::span<const Hit> hits, std::span<Rgb> out) {
    radiance(rays, hits, out, 1);
  }

 private:
  /// Rays that hits ask for, and the sums that they add to.
  struct Spawned {
    void clear();
    void add(const Ray& ray, Rgb weight, std::uint32_t sum);

    std::vector<Ray> rays;
    std::vector<Rgb> weights;
    std::vector<std::uint32_t> sums;
    std::vector<Hit> hits;
    std::vector<Rgb> radiance;
  };

  /// What the batch of one depth has to remember while deeper ones are traced.
  struct Level {
    std::vector<LitPoint> points;
    Spawned reflected, refracted;
  };

  /// `depth` counts the rays of the chains, the camera's being 1.
  void radiance(std::span<const Ray> rays, std::span<const Hit> hits, std::span<Rgb> out, std::uint32_t depth);
  void shade_hit(const Ray& ray, const Hit& hit, std::uint32_t sum, std::uint32_t depth, Level& level) const;
  static void spawn(const Material& material, const Shading& at, const LitPoint& point, Level& level);
  void follow(Spawned& spawned, std::span<Rgb> sums, std::uint32_t depth, std::uint64_t& count);

  const Scene& scene_;
  const Accel& accel_;
  std::uint32_t max_depth_;
  RayCounts& counts_;
  TraceLog log_;
  std::stop_token stop_;
  DirectLight direct_light_;
  std::deque<Level> levels_;  ///< By depth; none moves when one is added.
};

}  // namespace tessera
