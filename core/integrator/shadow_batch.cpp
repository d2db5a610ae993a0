#include "core/integrator/shadow_batch.h"

#include "core/integrator/spawn.h"
#include "core/material/surface_at.h"

namespace tessera {

void ShadowBatch::add(const Ray& ray, Rgb radiance, std::uint32_t sum) {
  rays_.push_back(ray);
  lights_.push_back({radiance, sum});
}

void ShadowBatch::trace(const Accel& accel, std::span<Rgb> sums, RayCounts& counts, TraceLog log) {
  counts.shadow += rays_.size();
  hidden_.resize(rays_.size());
  if (has_alpha_)
    pass_alpha(accel, counts, log);
  else
    accel.occluded(rays_, hidden_, log);
  for (std::size_t i = 0; i < rays_.size(); ++i)
    if (!hidden_[i]) sums[lights_[i].sum] = sums[lights_[i].sum] + lights_[i].radiance;
  rays_.clear();
  lights_.clear();
}

/// Surface by surface, each of which takes its share.
void ShadowBatch::pass_alpha(const Accel& accel, RayCounts& counts, TraceLog log) {
  passing_rays_.assign(rays_.begin(), rays_.end());
  passed_.assign(rays_.size(), Hit{});
  passing_.resize(rays_.size());
  for (std::uint32_t i = 0; i < rays_.size(); ++i) passing_[i] = i;
  while (!passing_.empty()) {
    hits_.resize(passing_.size());
    find_behind(accel, passing_rays_, passed_, hits_, log);
    std::size_t left = 0;
    for (std::size_t i = 0; i < passing_.size(); ++i) {
      const std::uint32_t ray = passing_[i];
      hidden_[ray] = hits_[i].t < kInfinity;
      if (!hidden_[ray]) continue;
      const float alpha = alpha_at(scene_, scene_.objects[hits_[i].object], hits_[i].primitive, passing_rays_[i]);
      if (alpha >= 1) continue;
      lights_[ray].radiance = lights_[ray].radiance * (1 - alpha);
      hidden_[ray] = lights_[ray].radiance.is_black();
      if (hidden_[ray]) continue;
      passing_rays_[left] = passing_rays_[i];
      passing_rays_[left].t_min = hits_[i].t;
      passed_[left] = hits_[i];
      passing_[left++] = ray;
    }
    counts.shadow += left;
    passing_.resize(left);
    passing_rays_.resize(left);
    passed_.resize(left);
  }
}

}  // namespace tessera
