#include "core/integrator/direct_light.h"

#include <variant>

#include "core/integrator/spawn.h"
#include "core/light/illuminate.h"
#include "core/material/shade.h"

namespace tessera {

DirectLight::DirectLight(const Accel& accel, RayCounts& counts, TraceLog log)
    : accel_(accel), counts_(counts), log_(log) {}

void DirectLight::add(const Light& light, std::span<const LitPoint> points, std::span<Rgb> sums) {
  if (const auto* point = std::get_if<PointLight>(&light)) add_unhidden(*point, points, sums);
  if (const auto* directional = std::get_if<DirectionalLight>(&light)) add_unhidden(*directional, points, sums);
  if (const auto* ambient = std::get_if<AmbientLight>(&light)) add_ambient(*ambient, points, sums);
}

void DirectLight::add_ambient(const AmbientLight& light, std::span<const LitPoint> points, std::span<Rgb> sums) {
  for (const LitPoint& point : points) sums[point.sum] = sums[point.sum] + point.material->diffuse * light.radiance;
}

template <typename Source>
void DirectLight::add_unhidden(const Source& light, std::span<const LitPoint> points, std::span<Rgb> sums) {
  rays_.clear();
  lit_.clear();
  for (const LitPoint& point : points) {
    const Illumination in = illuminate(light, point.origin);
    const Rgb lit = shade(*point.material, point.normal, point.to_viewer, in.to_light, in.irradiance);
    if (lit.is_black()) continue;
    const bool beneath = !(dot(in.to_light, point.flat_normal) > 0);
    rays_.push_back(shadow_ray(light, beneath ? point.smooth_origin : point.origin));
    rays_.back().leaves = left_by(rays_.back().direction, point.flat_normal, point.surface);
    lit_.push_back({lit, point.sum, beneath && point.smooth_origin != point.origin ? &point : nullptr});
  }
  if (rays_.empty()) return;
  counts_.shadow += rays_.size();
  hidden_.resize(rays_.size());
  trace(light);
  hide_what_leaks();
  for (std::size_t i = 0; i < lit_.size(); ++i)
    if (!hidden_[i]) sums[lit_[i].sum] = sums[lit_[i].sum] + lit_[i].radiance;
}

void DirectLight::hide_what_leaks() {
  rays_.clear();
  bridged_.clear();
  for (std::size_t i = 0; i < lit_.size(); ++i) {
    const LitPoint* point = lit_[i].lifted;
    if (!point || hidden_[i]) continue;
    const Vec3 way = to_float(to_double(point->smooth_origin) - to_double(point->origin));
    rays_.push_back({point->origin, way, 0, kJustBeyond, left_by(way, point->flat_normal, point->surface)});
    bridged_.push_back(i);
  }
  if (rays_.empty()) return;
  counts_.shadow += rays_.size();
  blocked_.resize(rays_.size());
  accel_.occluded(rays_, blocked_, log_);
  for (std::size_t i = 0; i < rays_.size(); ++i) hidden_[bridged_[i]] = blocked_[i];
}

void DirectLight::trace(const PointLight& light) { accel_.occluded_fan(light.position, rays_, hidden_, log_); }
void DirectLight::trace(const DirectionalLight&) { accel_.occluded(rays_, hidden_, log_); }

}  // namespace tessera
