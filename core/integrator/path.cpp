#include "core/integrator/path.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <variant>

#include "core/integrator/shading.h"
#include "core/integrator/spawn.h"
#include "core/material/bsdf.h"
#include "core/material/surface_at.h"
#include "core/math/portable.h"
#include "core/sampling/warp.h"

namespace tessera {
namespace {

/// Segments before roulette begins.
constexpr std::uint32_t kRouletteDepth = 5;

/// The weight of what was drawn with density `drawn`, and might have been with `other` (power heuristic).
float mis_weight(float drawn, float other) {
  const float ratio = other / drawn;
  return 1 / (1 + ratio * ratio);
}

/// Beer's law. Nothing is left of what is absorbed for ever.
Rgb transmittance(Rgb absorption, float distance) {
  const auto left = [&](float a) {
    return a > 0 ? static_cast<float>(portable_exp2(-std::numbers::log2e * a * distance)) : 1;
  };
  return {left(absorption.r), left(absorption.g), left(absorption.b)};
}

}  // namespace

/// A surface that a path has met.
struct PathTracer::Vertex {
  Vertex(const SurfacePoint& point, Vec3 direction, PrimitiveId id, const Surface& surface, Rgb emitted)
      : shading(point, direction),
        primitive(id),
        emission(emitted),
        bsdf(make_bsdf(surface, shading.entering)),
        frame(basis_around(shading.normal)),
        to_viewer(frame.to_local(shading.to_viewer)),
        light_normal(has_smooth_transmission(bsdf) ? Vec3{} : shading.normal),
        origin(spawn_origin(point, to_double(shading.flat_normal))) {}

  Shading shading;
  PrimitiveId primitive;
  Rgb emission;  ///< On the sides that emit.
  Bsdf bsdf;
  Basis frame;
  Vec3 to_viewer;     ///< In the frame.
  Vec3 light_normal;  ///< For `LightTable`.
  Vec3 origin;        ///< Of rays that stay on the viewer's side.
};

PathTracer::PathTracer(const Scene& scene, const Features& features, const Accel* accel, const LightTable* lights,
                       const Sampler& sampler, const Options& options, RayCounts& counts, TraceLog log)
    : scene_(scene),
      accel_(accel),
      lights_(lights),
      sampler_(sampler),
      options_(options),
      has_alpha_(features.alpha),
      has_textures_(features.textures),
      has_ground_(features.ground),
      has_sky_(features.sky),
      has_emitters_(features.emitters),
      has_unlit_(features.unlit),
      has_absorption_(features.absorption),
      counts_(counts),
      log_(log),
      leaving_(scene, features.alpha, accel, counts, log),
      shadows_(scene, features.alpha),
      ground_(scene, features.alpha) {}

void PathTracer::begin(std::span<const SampleId> samples, RaySpan rays, std::span<const Hit> hits, Output out) {
  out_ = out;
  std::ranges::fill(out.radiance, Rgb());
  paths_.clear();
  rays_.clear();
  paths_.reserve(samples.size());
  rays_.reserve(samples.size());
  hits_.clear();
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    if (!may_bring(hits[i])) continue;
    paths_.push_back({.numbers = sampler_.at(samples[i]), .sum = i});
    rays_.push_back(rays[i]);
    hits_.push_back(hits[i]);
  }
  has_hits_ = true;
  vertex_ = 0;
}

bool PathTracer::may_bring(const Hit& hit) const {
  if (hit.t == kInfinity) return !options_.hides_background || has_ground_;
  return options_.max_depth > 1 || has_emitters_ || has_unlit_ || has_alpha_;
}

bool PathTracer::go_on() {
  if (has_hits_) {
    shade();
    has_hits_ = false;
  } else if (!paths_.empty()) {
    counts_.scattered += rays_.size();
    hits_.resize(rays_.size());
    if (has_alpha_)
      find_behind(*accel_, rays_, passed_, hits_, log_);
    else
      accel_->closest(rays_, hits_, log_);
    has_hits_ = true;
    ++vertex_;
    return true;
  }
  if (!shadows_.empty()) {
    shadows_.trace(*accel_, out_.radiance, counts_, log_);
    return true;
  }
  if (!ground_.empty()) {
    ground_.trace(*accel_, out_, counts_, log_);
    return true;
  }
  return !paths_.empty();
}

void PathTracer::shade() {
  std::size_t left = 0;
  if (has_alpha_) passed_.resize(paths_.size());
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    const Hit hit = hits_[i];
    const Next next = shade_path(paths_[i], rays_[i], hit);
    if (next == Next::nothing) continue;
    if (next == Next::what_is_behind) rays_[i].t_min = hit.t;
    if (has_alpha_) passed_[left] = next == Next::what_is_behind ? hit : Hit{};
    paths_[left] = paths_[i];
    rays_[left++] = rays_[i];
  }
  paths_.erase(paths_.begin() + static_cast<std::ptrdiff_t>(left), paths_.end());
  rays_.resize(left);
  if (has_alpha_) passed_.resize(left);
}

PathTracer::Next PathTracer::shade_path(Path& path, Ray& ray, const Hit& hit) {
  // What surfaces choose is unit already.
  const Vec3 direction =
      vertex_ > 0 && !path.is_direct ? ray.direction : UnitVec3::normalize(ray.direction).value_or(UnitVec3::z());
  if (has_absorption_) {
    path.throughput = path.throughput * transmittance(path.absorption, hit.t - ray.t_min);
    if (path.throughput.is_black()) return Next::nothing;
  }
  if (hit.t == kInfinity) {
    add_escaped(path, ray, direction);
    return Next::nothing;
  }
  const Object& object = scene_.objects[hit.object];
  const Material& material = scene_.materials[object.material];
  const float alpha = has_alpha_ ? alpha_at(scene_, object, hit.primitive, ray) : 1;
  const bool passes = alpha < 1;
  // Where the path can only go on behind, both its shares are known, and nothing has to be drawn.
  const bool is_shade = passes && is_black(material.surface);
  if (passes && !is_shade && path.numbers.one(dimension(vertex_, Decision::alpha)) >= alpha)
    return Next::what_is_behind;
  const bool is_unlit = has_unlit_ && std::holds_alternative<Unlit>(material.surface);
  if (material.emission.is_black() && !is_unlit && (is_shade || path.depth == options_.max_depth))
    return is_shade ? behind(path, alpha) : Next::nothing;
  const Vertex at = vertex_at(ray, direction, hit);
  if (!at.emission.is_black()) add_emitted(path, at, is_shade ? alpha : 1);
  if (is_unlit) add(path.sum, path.throughput * std::get<UnlitBsdf>(at.bsdf).color * (is_shade ? alpha : 1));
  if (is_shade) return behind(path, alpha);
  if (is_unlit) return Next::nothing;
  if (path.depth == options_.max_depth) return Next::nothing;
  path.is_direct = false;
  sample_light(path, at);
  ++path.depth;
  return scatter(path, ray, at) ? Next::its_ray : Next::nothing;
}

PathTracer::Vertex PathTracer::vertex_at(const Ray& ray, Vec3 direction, const Hit& hit) const {
  const Object& object = scene_.objects[hit.object];
  const Material& material = scene_.materials[object.material];
  SurfacePoint point = world_surface(scene_, hit.object, hit.primitive, ray, hit.t);
  if (!has_textures_ || !varies(material))
    return {point, direction, {hit.object, hit.primitive}, material.surface, material.emission};
  const SurfaceAt at = surface_at(scene_, object, hit.primitive, point);
  return {point, direction, {hit.object, hit.primitive}, at.surface, at.emission};
}

PathTracer::Next PathTracer::behind(Path& path, float alpha) {
  path.throughput = path.throughput * (1 - alpha);
  return path.throughput.is_black() ? Next::nothing : Next::what_is_behind;
}

void PathTracer::add_escaped(const Path& path, const Ray& ray, Vec3 direction) {
  if (path.is_direct) {
    out_.covered[path.sum] = 1 - path.throughput.g;
    const Rgb seen = options_.hides_background ? Rgb() : background(path, direction);
    if (has_ground_ &&
        ground_.add(ray, path.numbers.two(dimension(vertex_, Decision::bsdf)), seen, path.throughput.g, path.sum))
      return;
    if (!seen.is_black()) add(path.sum, seen);
    return;
  }
  const Rgb seen = background(path, direction);
  if (!seen.is_black()) add(path.sum, seen);
}

Rgb PathTracer::background(const Path& path, Vec3 direction) const {
  if (!lights_) return {};
  auto [radiance, pdf] = lights_->escaped(path.from, direction);
  if (radiance.is_black()) return {};
  if (path.pdf > 0) radiance = radiance * mis_weight(path.pdf, pdf);
  return path.throughput * radiance;
}

void PathTracer::add_emitted(const Path& path, const Vertex& at, float share) {
  const Vec3 direction = -at.shading.to_viewer;
  const SurfacePoint& surface = at.shading.surface;
  if (!at.shading.entering && !scene_.materials[scene_.objects[at.primitive.object].material].emits_both_sides) return;
  Rgb radiance = at.emission;
  if (path.pdf > 0) {
    // As lights were sampled: the ray may have started on the smooth surface, beside that point.
    const Vec3d way = surface.position - path.from.point;
    const auto from_there = UnitVec3::normalize(way);
    radiance = radiance * mis_weight(path.pdf, lights_->pdf_hit(path.from, from_there ? Vec3(*from_there) : direction,
                                                                at.primitive, length(way), surface.geometric_normal));
  }
  add(path.sum, path.throughput * radiance * share);
}

void PathTracer::sample_light(Path& path, const Vertex& at) {
  if (!lights_ || lights_->empty() || !has_smooth_lobes(at.bsdf)) return;
  const float pick = lights_->count() == 1 ? 0.5F : path.numbers.one(dimension(vertex_, Decision::light_pick));
  path.from = lights_->viewpoint(at.shading.surface.position, at.light_normal);
  const auto light = lights_->sample(path.from, pick, path.numbers.two(dimension(vertex_, Decision::light)));
  if (!light) return;
  const Vec3 wi = at.frame.to_local(light->to_light);
  const BsdfValue value = evaluate(at.bsdf, at.to_viewer, wi);
  if (value.f_cos.is_black()) return;
  const auto way = leaving_.find(at.shading, at.primitive, at.origin, light->to_light, wi.z > 0);
  if (!way) return;
  const float weight = (light->is_delta ? 1 : mis_weight(light->pdf, value.pdf)) / light->pdf;
  Rgb radiance = path.throughput * value.f_cos * light->radiance * (weight * way->share);
  if (radiance.is_black()) return;
  Ray ray = lights_->shadow_ray(*light, way->ray.origin);
  ray.leaves = way->ray.leaves;
  if (has_absorption_) {
    const Rgb absorption = wi.z > 0 ? path.absorption : absorption_behind(path, at);
    radiance = radiance * transmittance(absorption, length(ray.direction) * ray.t_max);
  }
  shadows_.add(ray, radiance, path.sum);
}

bool PathTracer::scatter(Path& path, Ray& ray, const Vertex& at) {
  // Where nothing is left but to meet a light by chance, and none can be met, the ray would bring nothing.
  const bool is_last = path.depth == options_.max_depth;
  if (is_last && !has_sky_ && !has_emitters_ && !has_unlit_) return false;
  const float lobe = has_one_lobe(at.bsdf) ? 0 : path.numbers.one(dimension(vertex_, Decision::bsdf_lobe));
  const auto chosen = sample(at.bsdf, at.to_viewer, lobe, path.numbers.two(dimension(vertex_, Decision::bsdf)));
  if (!chosen) return false;
  path.throughput = path.throughput * chosen->weight;
  path.eta_scale *= chosen->eta_scale;
  if (path.depth > kRouletteDepth && !survives(path, path.numbers.one(dimension(vertex_, Decision::roulette))))
    return false;
  if (path.throughput.is_black()) return false;
  const Vec3 direction = at.frame.to_world(chosen->wi);
  const auto way = leaving_.find(at.shading, at.primitive, at.origin, direction, !chosen->transmits);
  if (!way || (is_last && !has_sky_ && !has_unlit_ && !lights_->may_meet(way->ray))) return false;
  path.throughput = path.throughput * way->share;
  if (has_absorption_ && chosen->transmits) path.absorption = absorption_behind(path, at);
  ray = way->ray;
  path.pdf = chosen->is_delta ? 0 : chosen->pdf;
  return true;
}

Rgb PathTracer::absorption_behind(const Path& path, const Vertex& at) const {
  const Material& material = scene_.materials[scene_.objects[at.primitive.object].material];
  if (!lets_light_in(material.surface)) return path.absorption;
  return at.shading.entering ? material.absorption : Rgb();
}

bool PathTracer::survives(Path& path, float number) {
  const float chance = largest(path.throughput) * path.eta_scale;
  if (chance >= 1) return true;
  if (!(number < chance)) return false;
  path.throughput = path.throughput * (1 / chance);
  return true;
}

}  // namespace tessera
