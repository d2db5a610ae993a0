#include "core/render/tile_renderer.h"

#include <algorithm>
#include <utility>

#include "core/integrator/ambient_occlusion.h"
#include "core/integrator/no_light.h"
#include "core/integrator/path.h"
#include "core/integrator/shading.h"
#include "core/integrator/spawn.h"
#include "core/integrator/whitted.h"
#include "core/material/bsdf.h"
#include "core/material/surface_at.h"
#include "core/math/float_environment.h"
#include "core/sampling/warp.h"

namespace tessera {
namespace {

/// Samples that are traced together where tests are counted.
constexpr std::size_t kCountedChunk = 32;

/// A chunk whose batches of rays take longer is followed by a smaller one, as others wait for their turn; a chunk whose
/// batches take less than half of it, by a larger one.
constexpr std::chrono::milliseconds kLongBatch{10};

/// Fewer samples aren't worth another renderer.
constexpr std::uint64_t kLeastPart = 64;

bool records_costs(const Settings& settings) {
  return settings.aovs.contains(Aov::cost_volumes) || settings.aovs.contains(Aov::cost_primitives);
}

std::unique_ptr<Integrator> make_integrator(const RenderContext& context, RayCounts& counts, TraceLog log) {
  const Plan& plan = context.plan;
  const Scene& scene = *context.scene;
  switch (plan.integrator) {
    case IntegratorKind::automatic:
      break;
    case IntegratorKind::none:
      return std::make_unique<NoLight>();
    case IntegratorKind::whitted:
      return std::make_unique<Whitted>(scene, plan.features, *context.accel, plan.max_depth, counts, log);
    case IntegratorKind::ambient_occlusion:
      return std::make_unique<AmbientOcclusion>(scene, plan.features, context.accel.get(), context.sampler,
                                                context.settings.ambient_occlusion_reach, counts, log);
    case IntegratorKind::direct:
    case IntegratorKind::path:
      return std::make_unique<PathTracer>(
          scene, plan.features, context.accel.get(), context.lights.get(), context.sampler,
          PathTracer::Options{plan.max_depth, context.settings.transparent}, counts, log);
  }
  return nullptr;
}

bool shows_ground(const RenderContext& context) {
  return context.plan.features.ground && traces_paths(context.plan.integrator);
}

/// What a ray brings that hits nothing, wherever it goes; nothing where that depends on its direction.
std::optional<Rgb> even_background(const RenderContext& context) {
  if (shows_ground(context)) return std::nullopt;
  if (context.settings.transparent || context.plan.integrator == IntegratorKind::none) return Rgb();
  if (!traces_paths(context.plan.integrator)) return context.scene->background;
  if (!context.plan.features.even_sky) return std::nullopt;
  return environment_of(*context.scene).radiance;
}

Rgb clamped(Rgb c, float most) { return {std::min(c.r, most), std::min(c.g, most), std::min(c.b, most)}; }

}  // namespace

bool counts_tests(const Settings& settings) { return settings.count_tests || records_costs(settings); }

TileRenderer::TileRenderer(const RenderContext& context, std::size_t index, PassWork work)
    : TileRenderer(
          context, index,
          std::make_shared<Shared>(work.pass, TileResult{std::move(work.pixels), std::move(work.sums), {}, {}}),
          SampleOrder(context.plan.tiling.tiles[index].rect, *work.pass)) {}

TileRenderer::TileRenderer(const RenderContext& context, std::size_t index, std::shared_ptr<Shared> shared,
                           SampleOrder order)
    : context_(context),
      index_(index),
      tile_(context.plan.tiling.tiles[index]),
      shared_(std::move(shared)),
      pixels_(shared_->result.pixels),
      sums_(shared_->result.sums),
      order_(order),
      log_{context.tested.get(), counts_tests(context.settings) ? &tests_ : nullptr},
      camera_(context.rays) {
  if (tile_.first_level == FirstLevel::nothing && even_background(context)) return;
  integrator_ = make_integrator(context, rays_, log_);
  if (tile_.first_level == FirstLevel::candidates) candidates_ = context.plan.tiling.candidates_of(tile_);
}

bool TileRenderer::go_on(const std::function<bool()>& is_over) {
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
        return true;
      }
      begin_chunk();
    } else if (!integrator_->go_on()) {
      end_chunk();
    }
    const Clock::time_point before = std::exchange(now, Clock::now());
    longest_batch_ = std::max(longest_batch_, now - before);
  } while (!is_over());
  return false;
}

std::unique_ptr<TileRenderer> TileRenderer::split() {
  if (!integrator_ || log_.counts) return nullptr;
  const auto rest = order_.split(kLeastPart);
  if (!rest) return nullptr;
  std::unique_ptr<TileRenderer> other(new TileRenderer(context_, index_, shared_, *rest));
  const std::lock_guard lock(shared_->mutex);
  ++shared_->parts;
  return other;
}

bool TileRenderer::finish() {
  const StrictFloats strict;
  const std::lock_guard lock(shared_->mutex);
  shared_->result.rays += rays_;
  shared_->result.tests += tests_;
  if (--shared_->parts > 0) return false;
  resolve(sums_, *shared_->pass, pixels_);
  return true;
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
  const Rgb color = clamped(*even_background(context_), context_.settings.clamp);
  const Pass& pass = *shared_->pass;
  pass.for_blocks_in(tile_.rect, [&](PixelRect part, const SampleRange& samples) {
    if (samples.count > 0) sums_.add_equal(part, samples, color, 0);
  });
  samples_done_ = pass.samples_in(tile_.rect);
  rays_.camera_skipped = samples_done_;
}

void TileRenderer::begin_chunk() {
  before_chunk_ = tests_;
  trace_first_level();
  record_aovs();
  radiance_.resize(camera_.size());
  covered_.resize(camera_.size());
  for (std::size_t i = 0; i < hits_.size(); ++i) covered_[i] = hits_[i].t < kInfinity ? 1 : 0;
  integrator_->begin(samples_, camera_.rays(), hits_, {radiance_, covered_});
}

void TileRenderer::end_chunk() {
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const std::size_t at = pixel(samples_[i]);
    const bool is_hidden = context_.settings.transparent && covered_[i] == 0;
    const Rgb color = is_hidden ? Rgb() : clamped(radiance_[i], context_.settings.clamp);
    sums_.add(at, samples_[i].index, color, covered_[i]);
    sums_.add(Aov::alpha, at, covered_[i]);
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
    const Vec2 lens = context_.rays.has_lens() ? context_.sampler.two(s, kLensDimension) : Vec2();
    camera_.add(s.x + offset.x, s.y + offset.y, lens);
  }
  hits_.resize(camera_.size());
  if (tile_.first_level == FirstLevel::nothing) {
    std::ranges::fill(hits_, Hit{});
    rays_.camera_skipped += camera_.size();
    return;
  }
  camera_.closest(*context_.accel, hits_, log_, candidates_);
  rays_.camera += camera_.size();
  rays_.camera_hits +=
      static_cast<std::uint64_t>(std::ranges::count_if(hits_, [](const Hit& hit) { return hit.t < kInfinity; }));
}

void TileRenderer::record_aovs() {
  Pixels& out = pixels_;
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
    if (out.has(Aov::base_color)) {
      const Object& object = context_.scene->objects[hit.object];
      out.record(Aov::base_color, at, base_color(context_.scene->materials[object.material].surface));
    }
    if (!out.has(Aov::normal) && !out.has(Aov::position)) continue;
    const SurfacePoint surface = world_surface(*context_.scene, hit.object, hit.primitive, camera_.rays()[i], hit.t);
    out.record(Aov::normal, at, to_float(surface.shading_normal));
    out.record(Aov::position, at, to_float(surface.position));
  }
}

void TileRenderer::record_albedo(std::size_t at, const Ray& ray, const Hit& hit) {
  const Object& object = context_.scene->objects[hit.object];
  const Material& material = context_.scene->materials[object.material];
  SurfacePoint point = world_surface(*context_.scene, hit.object, hit.primitive, ray, hit.t);
  const Surface surface =
      varies(material) ? surface_at(*context_.scene, object, hit.primitive, point).surface : material.surface;
  const Shading shading(point, UnitVec3::normalize(ray.direction).value_or(UnitVec3::z()));
  const Vec3 to_viewer = basis_around(shading.normal).to_local(shading.to_viewer);
  sums_.add(Aov::albedo, at, albedo(make_bsdf(surface, shading.entering), to_viewer));
}

/// What the rays of a chunk have cost, all of them of one pixel.
void TileRenderer::record_costs(std::size_t at) {
  const auto cost = [&](std::uint64_t TestCounts::*count) {
    return static_cast<float>(tests_.*count - before_chunk_.*count);
  };
  sums_.add(Aov::cost_volumes, at, cost(&TestCounts::volume_tests));
  sums_.add(Aov::cost_primitives, at, cost(&TestCounts::object_tests));
}

}  // namespace tessera
