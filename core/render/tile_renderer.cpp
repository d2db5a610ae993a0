#include "core/render/tile_renderer.h"

#include <algorithm>

#include "core/integrator/ambient_occlusion.h"
#include "core/integrator/path.h"
#include "core/integrator/shading.h"
#include "core/integrator/spawn.h"
#include "core/integrator/whitted.h"
#include "core/material/bsdf.h"
#include "core/math/float_environment.h"
#include "core/sampling/warp.h"

namespace tessera {
namespace {

/// Samples that are traced together where tests are counted.
constexpr std::size_t kCountedChunk = 32;

/// A chunk whose batches of rays take longer is followed by a smaller one, as others wait for their turn; a chunk whose
/// batches take less than half of it, by a larger one.
constexpr std::chrono::milliseconds kLongBatch{10};

bool records_costs(const Settings& settings) {
  return settings.aovs.contains(Aov::cost_volumes) || settings.aovs.contains(Aov::cost_primitives);
}

/// The same sum and the same division, whether samples were traced or known to be background (law L6).
Rgb mean(Rgb sum, std::uint32_t samples) {
  const auto n = static_cast<float>(samples);
  return {sum.r / n, sum.g / n, sum.b / n};
}

/// The sum of a pixel's samples, added one by one. It stops growing when a sample is less than half its last bit: after
/// fewer than 2^25 of them.
Rgb sum_of_equal(Rgb sample, std::uint32_t samples) {
  Rgb sum;
  for (std::uint32_t i = 0; i < samples; ++i) {
    const Rgb next = sum + sample;
    if (next == sum) break;
    sum = next;
  }
  return sum;
}

std::unique_ptr<Integrator> make_integrator(const RenderContext& context, RayCounts& counts, TraceLog log) {
  const Plan& plan = context.plan;
  const Scene& scene = *context.scene;
  switch (plan.integrator) {
    case IntegratorKind::automatic:
      break;
    case IntegratorKind::whitted:
      return std::make_unique<Whitted>(scene, plan.features, *context.accel, plan.max_depth, counts, log);
    case IntegratorKind::ambient_occlusion:
      return std::make_unique<AmbientOcclusion>(scene, context.accel.get(), context.sampler,
                                                context.settings.ambient_occlusion_reach, counts, log);
    case IntegratorKind::direct:
    case IntegratorKind::path:
      return std::make_unique<PathTracer>(scene, plan.features, context.accel.get(), *context.lights, context.sampler,
                                          PathTracer::Options{plan.max_depth, context.settings.transparent}, counts,
                                          log);
  }
  return nullptr;
}

/// What a ray brings that hits nothing, wherever it goes; nothing where that depends on its direction.
std::optional<Rgb> even_background(const RenderContext& context) {
  if (context.settings.transparent) return Rgb();
  if (!context.lights) return context.scene->background;
  if (!context.plan.features.even_sky) return std::nullopt;
  return context.lights->escaped(UnitVec3::z());
}

Rgb clamped(Rgb c, float most) { return {std::min(c.r, most), std::min(c.g, most), std::min(c.b, most)}; }

}  // namespace

bool counts_tests(const Settings& settings) { return settings.count_tests || records_costs(settings); }

TileRenderer::TileRenderer(const RenderContext& context, std::size_t index)
    : context_(context),
      tile_(context.plan.tiling.tiles[index]),
      order_(tile_.rect, context.settings.samples),
      result_{Pixels(tile_.rect, context.settings.aovs), {}, {}},
      log_{context.tested.get(), counts_tests(context.settings) ? &result_.tests : nullptr},
      camera_(context.rays) {
  if (tile_.first_level == FirstLevel::nothing && even_background(context)) return;
  integrator_ = make_integrator(context, result_.rays, log_);
  if (tile_.first_level == FirstLevel::candidates) candidates_ = context.plan.tiling.candidates_of(tile_);
}

bool TileRenderer::go_on(Clock::time_point until, const std::stop_token& stop) {
  const StrictFloats strict;
  if (!integrator_) {
    fill_with_background();
    return true;
  }
  // Costs are told apart by pixel.
  const std::size_t most_pixels = records_costs(context_.settings) ? 1 : integrator_->batch_size();
  Clock::time_point now = Clock::now();
  do {
    if (samples_.empty()) {
      if (!order_.next(samples_at_once(), most_pixels, samples_)) {
        finish();
        return true;
      }
      begin_chunk();
    } else if (!integrator_->go_on()) {
      end_chunk();
    }
    const Clock::time_point before = std::exchange(now, Clock::now());
    longest_batch_ = std::max(longest_batch_, now - before);
  } while (now < until && !stop.stop_requested());
  return false;
}

/// Sums become means.
void TileRenderer::finish() {
  const std::uint32_t samples = context_.settings.samples;
  for (Rgb& color : result_.pixels.color) color = mean(color, samples);
  for (Rgb& albedo : result_.pixels.plane<Rgb>(Aov::albedo)) albedo = mean(albedo, samples);
  for (float& alpha : result_.pixels.plane<float>(Aov::alpha)) alpha /= static_cast<float>(samples);
}

/// What structures count may depend on which rays go together: so it is always the same number of them, and few, as
/// those that are counted may cost much.
std::size_t TileRenderer::samples_at_once() const {
  return log_.counts ? kCountedChunk : std::min(context_.chunk->load(), integrator_->batch_size());
}

void TileRenderer::fit_chunks() {
  const std::size_t size = samples_.size();
  if (longest_batch_ > kLongBatch)
    *context_.chunk = std::max<std::size_t>(1, size * kLongBatch / longest_batch_);
  else if (longest_batch_ < kLongBatch / 2 && size < integrator_->batch_size() && size == *context_.chunk)
    *context_.chunk = std::min(integrator_->batch_size(), 2 * size);
  longest_batch_ = {};
}

void TileRenderer::fill_with_background() {
  const std::uint32_t samples = context_.settings.samples;
  std::ranges::fill(result_.pixels.color,
                    mean(sum_of_equal(clamped(*even_background(context_), context_.settings.clamp), samples), samples));
  samples_done_ = static_cast<std::uint64_t>(tile_.rect.area()) * samples;
  result_.rays.camera_skipped = samples_done_;
}

void TileRenderer::begin_chunk() {
  if (samples_.front().index == 0) before_pixel_ = result_.tests;
  trace_first_level();
  record_aovs();
  radiance_.resize(camera_.size());
  covered_.resize(camera_.size());
  for (std::size_t i = 0; i < hits_.size(); ++i) covered_[i] = hits_[i].t < kInfinity;
  integrator_->begin(samples_, camera_.rays(), hits_, {radiance_, covered_});
}

void TileRenderer::end_chunk() {
  std::vector<float>& alpha = result_.pixels.plane<float>(Aov::alpha);
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    if (!alpha.empty()) alpha[pixel(samples_[i])] += covered_[i];
    Rgb& sum = result_.pixels.color[pixel(samples_[i])];
    const bool is_hidden = context_.settings.transparent && !covered_[i];
    sum = sum + (is_hidden ? Rgb() : clamped(radiance_[i], context_.settings.clamp));
  }
  if (records_costs(context_.settings)) record_costs(pixel(samples_.front()));
  fit_chunks();
  samples_done_ += samples_.size();
  samples_.clear();
}

void TileRenderer::trace_first_level() {
  camera_.clear();
  for (const SampleId& s : samples_) {
    const PixelOffset offset = context_.filter.sample(context_.sampler.film(s));
    camera_.add(s.x + offset.x, s.y + offset.y);
  }
  hits_.resize(camera_.size());
  if (tile_.first_level == FirstLevel::nothing) {
    std::ranges::fill(hits_, Hit{});
    result_.rays.camera_skipped += camera_.size();
    return;
  }
  camera_.closest(*context_.accel, hits_, log_, candidates_);
  result_.rays.camera += camera_.size();
  result_.rays.camera_hits +=
      static_cast<std::uint64_t>(std::ranges::count_if(hits_, [](const Hit& hit) { return hit.t < kInfinity; }));
}

void TileRenderer::record_aovs() {
  Pixels& out = result_.pixels;
  if (out.aovs().empty()) return;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const Hit& hit = hits_[i];
    if (hit.t == kInfinity) continue;
    const std::size_t at = pixel(samples_[i]);
    if (out.has(Aov::albedo)) record_albedo(at, camera_.rays()[i], hit);
    if (samples_[i].index != 0) continue;
    out.record(Aov::depth, at, hit.t);  // a camera ray's t is depth
    out.record(Aov::primitive_id, at, hit.primitive);
    out.record(Aov::object_id, at, hit.object);
    if (!out.has(Aov::normal) && !out.has(Aov::position)) continue;
    const SurfacePoint surface = world_surface(*context_.scene, hit.object, hit.primitive, camera_.rays()[i], hit.t);
    out.record(Aov::normal, at, to_float(surface.shading_normal));
    out.record(Aov::position, at, to_float(surface.position));
  }
}

void TileRenderer::record_albedo(std::size_t at, const Ray& ray, const Hit& hit) {
  const Material& material = context_.scene->materials[context_.scene->objects[hit.object].material];
  const Shading shading(world_surface(*context_.scene, hit.object, hit.primitive, ray, hit.t),
                        UnitVec3::normalize(ray.direction).value_or(UnitVec3::z()));
  Rgb& sum = result_.pixels.plane<Rgb>(Aov::albedo)[at];
  sum = sum + albedo(make_bsdf(material, shading.entering), basis_around(shading.normal).to_local(shading.to_viewer));
}

/// What the rays of a pixel have cost so far, were they all.
void TileRenderer::record_costs(std::size_t at) {
  const auto per_sample = [&](std::uint64_t TestCounts::*count) {
    return static_cast<float>(static_cast<double>(result_.tests.*count - before_pixel_.*count) /
                              context_.settings.samples);
  };
  result_.pixels.record(Aov::cost_volumes, at, per_sample(&TestCounts::volume_tests));
  result_.pixels.record(Aov::cost_primitives, at, per_sample(&TestCounts::object_tests));
}

}  // namespace tessera
