#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/integrator/integrator.h"
#include "core/integrator/ray_counts.h"
#include "core/scene/scene.h"

namespace tessera {

/// How much of the sky a surface sees (Zhukov, Iones & Kronin 1998): the share of a hemisphere of directions, weighed
/// with the cosine, in which nothing is met within a reach. A sample looks one way and is 0 or 1 in each channel; where
/// it meets nothing at all it is the scene's background.
class AmbientOcclusion final : public Integrator {
 public:
  /// `reach` in metres, > 0. All have to outlive this.
  AmbientOcclusion(const Scene& scene, const Accel* accel, const Sampler& sampler, float reach, RayCounts& counts,
                   TraceLog log = {});

  std::size_t batch_size() const override { return 4096; }
  void begin(std::span<const SampleId> samples, RaySpan rays, std::span<const Hit> hits, Output out) override;
  bool go_on() override;

 private:
  const Scene& scene_;
  const Accel* accel_;
  const Sampler& sampler_;
  float reach_;
  RayCounts& counts_;
  TraceLog log_;
  std::span<Rgb> out_;
  std::vector<Ray> rays_;
  std::vector<std::size_t> asking_;  ///< For each ray, into `out`.
  std::vector<std::uint8_t> hidden_;
};

}  // namespace tessera
