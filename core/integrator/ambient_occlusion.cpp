#include "core/integrator/ambient_occlusion.h"

#include <algorithm>

#include "core/integrator/shading.h"
#include "core/integrator/spawn.h"
#include "core/material/surface_at.h"
#include "core/sampling/warp.h"

namespace tessera {

AmbientOcclusion::AmbientOcclusion(const Scene& scene, const Features& features, const Accel* accel,
                                   const Sampler& sampler, float reach, RayCounts& counts, TraceLog log)
    : scene_(scene),
      accel_(accel),
      sampler_(sampler),
      reach_(reach),
      counts_(counts),
      log_(log),
      leaving_(scene, features.alpha, accel, counts, log),
      shadows_(scene, features.alpha) {}

void AmbientOcclusion::begin(std::span<const SampleId> samples, RaySpan rays, std::span<const Hit> hits, Output out) {
  out_ = out;
  std::ranges::fill(out.radiance, Rgb());
  looking_.clear();
  rays_.clear();
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    looking_.push_back({sampler_.at(samples[i]), i});
    rays_.push_back(rays[i]);
  }
  hits_.assign(hits.begin(), hits.end());
  vertex_ = 0;
  look();
}

bool AmbientOcclusion::go_on() {
  if (!looking_.empty()) {
    counts_.scattered += rays_.size();
    find_behind(*accel_, rays_, passed_, hits_, log_);
    ++vertex_;
    look();
    return true;
  }
  if (!shadows_.empty()) shadows_.trace(*accel_, out_.radiance, counts_, log_);
  return false;
}

/// Where samples end; those that pass what they have met are left.
void AmbientOcclusion::look() {
  std::size_t left = 0;
  passed_.resize(looking_.size());
  for (std::size_t i = 0; i < looking_.size(); ++i) {
    const Hit hit = hits_[i];
    if (hit.t == kInfinity) {
      out_.radiance[looking_[i].sum] = scene_.background;
      out_.covered[looking_[i].sum] = 0;
      continue;
    }
    const float alpha = alpha_at(scene_, scene_.objects[hit.object], hit.primitive, rays_[i]);
    if (alpha >= 1 || looking_[i].numbers.one(dimension(vertex_, Decision::alpha)) < alpha) {
      ask(looking_[i], rays_[i], hit);
      continue;
    }
    rays_[i].t_min = hit.t;
    passed_[left] = hit;
    looking_[left] = looking_[i];
    rays_[left++] = rays_[i];
  }
  looking_.erase(looking_.begin() + static_cast<std::ptrdiff_t>(left), looking_.end());
  rays_.resize(left);
  hits_.resize(left);
  passed_.resize(left);
}

void AmbientOcclusion::ask(const Looking& looking, const Ray& ray, const Hit& hit) {
  const PrimitiveId primitive{hit.object, hit.primitive};
  const Shading at(world_surface(scene_, hit.object, hit.primitive, ray, hit.t),
                   UnitVec3::normalize(ray.direction).value_or(UnitVec3::z()));
  const Vec2 u = looking.numbers.two(dimension(vertex_, Decision::bsdf));
  const Vec3 direction = basis_around(at.normal).to_world(cosine_hemisphere(u));
  const Vec3 origin = spawn_origin(at.surface, to_double(at.flat_normal));
  auto way = leaving_.find(at, primitive, origin, direction, true);
  if (!way) return;
  way->ray.t_max = reach_;
  shadows_.add(way->ray, Rgb{1, 1, 1} * way->share, looking.sum);
}

}  // namespace tessera
