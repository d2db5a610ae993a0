#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/accel/accel.h"
#include "core/integrator/ray_counts.h"
#include "core/math/rgb.h"
#include "core/scene/scene.h"

namespace tessera {

/// Light that arrives unless something is in the way. For one thread at a time.
class ShadowBatch {
 public:
  /// `has_alpha`: a surface of the scene lets a part of the light pass.
  ShadowBatch(const Scene& scene, bool has_alpha) : scene_(scene), has_alpha_(has_alpha) {}

  /// Light that would be added to a sum.
  void add(const Ray& ray, Rgb radiance, std::uint32_t sum);

  bool empty() const { return rays_.empty(); }

  /// Traces all rays and adds what arrives to the sums, in the order in which it was added. Then it is empty.
  void trace(const Accel& accel, std::span<Rgb> sums, RayCounts& counts, TraceLog log);

 private:
  void pass_alpha(const Accel& accel, RayCounts& counts, TraceLog log);

  struct Light {
    Rgb radiance;
    std::uint32_t sum;
  };

  const Scene& scene_;
  bool has_alpha_;
  std::vector<Ray> rays_;
  std::vector<Light> lights_;  ///< For each of the rays.
  std::vector<std::uint8_t> hidden_;
  std::vector<Hit> hits_;
  std::vector<std::uint32_t> passing_;
  std::vector<Ray> passing_rays_;
};

}  // namespace tessera
