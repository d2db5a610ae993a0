#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/integrator/integrator.h"
#include "core/integrator/leaving_rays.h"
#include "core/integrator/ray_counts.h"
#include "core/integrator/shadow_batch.h"
#include "core/plan/features.h"
#include "core/scene/scene.h"

namespace tessera {

/// How much of the sky a surface sees (Zhukov, Iones & Kronin 1998): the share of a hemisphere of directions, weighed
/// with the cosine, in which nothing is met within a reach; surfaces that aren't all there (`Material::alpha`) hide as
/// much of it, and show what is behind them. A sample looks one way, and is the same in each channel; where it meets
/// nothing at all it is the scene's background.
class AmbientOcclusion final : public Integrator {
 public:
  /// `features` are the scene's; `reach` in metres, > 0. All have to outlive this.
  AmbientOcclusion(const Scene& scene, const Features& features, const Accel* accel, const Sampler& sampler,
                   float reach, RayCounts& counts, TraceLog log = {});

  std::size_t batch_size() const override { return 4096; }
  void begin(std::span<const SampleId> samples, RaySpan rays, std::span<const Hit> hits, Output out) override;
  bool go_on() override;

 private:
  struct Looking {
    PathSample numbers;
    std::uint32_t sum;  ///< Into `out`.
  };

  void look();
  void ask(const Looking& looking, const Ray& ray, const Hit& hit);

  const Scene& scene_;
  const Accel* accel_;
  const Sampler& sampler_;
  float reach_;
  RayCounts& counts_;
  TraceLog log_;
  Output out_;
  std::uint32_t vertex_ = 0;  ///< Surfaces that those still looking have passed.
  std::vector<Looking> looking_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_, passed_;  ///< As `find_behind` has them.
  LeavingRays leaving_;
  ShadowBatch shadows_;
};

}  // namespace tessera
