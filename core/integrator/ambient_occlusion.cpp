#include "core/integrator/ambient_occlusion.h"

#include "core/integrator/shading.h"
#include "core/integrator/spawn.h"
#include "core/sampling/warp.h"

namespace tessera {

AmbientOcclusion::AmbientOcclusion(const Scene& scene, const Accel* accel, const Sampler& sampler, float reach,
                                   RayCounts& counts, TraceLog log)
    : scene_(scene), accel_(accel), sampler_(sampler), reach_(reach), counts_(counts), log_(log) {}

void AmbientOcclusion::begin(std::span<const SampleId> samples, RaySpan rays, std::span<const Hit> hits, Output out) {
  out_ = out.radiance;
  rays_.clear();
  asking_.clear();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    out_[i] = hits[i].t == kInfinity ? scene_.background : Rgb();
    if (hits[i].t == kInfinity) continue;
    const PrimitiveId primitive{hits[i].object, hits[i].primitive};
    const Shading at(world_surface(scene_, primitive.object, primitive.primitive, rays[i], hits[i].t),
                     UnitVec3::normalize(rays[i].direction).value_or(UnitVec3::z()));
    const Vec2 u = sampler_.two(samples[i], dimension(0, Decision::bsdf));
    const Vec3 direction = basis_around(at.normal).to_world(cosine_hemisphere(u));
    if (!(dot(direction, at.flat_normal) > 0)) continue;
    rays_.push_back({spawn_origin(at.surface, to_double(at.flat_normal)), direction, 0, reach_, primitive});
    asking_.push_back(i);
  }
}

bool AmbientOcclusion::go_on() {
  if (rays_.empty()) return false;
  counts_.shadow += rays_.size();
  hidden_.resize(rays_.size());
  accel_->occluded(rays_, hidden_, log_);
  for (std::size_t i = 0; i < rays_.size(); ++i)
    if (!hidden_[i]) out_[asking_[i]] = {1, 1, 1};
  rays_.clear();
  return false;
}

}  // namespace tessera
