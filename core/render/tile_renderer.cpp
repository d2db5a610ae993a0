#include "core/render/tile_renderer.h"

#include <algorithm>

#include "core/integrator/spawn.h"
#include "core/math/float_environment.h"

namespace tessera {
namespace {

/// Samples that are traced together: enough for structures to gain from rays that go together, few enough for all that
/// is known of them to stay in the caches.
constexpr std::size_t kChunk = 1024;
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

}  // namespace

bool counts_tests(const Settings& settings) { return settings.count_tests || records_costs(settings); }

TileRenderer::TileRenderer(const RenderContext& context, std::size_t index)
    : context_(context),
      tile_(context.plan.tiling.tiles[index]),
      order_(tile_.rect, context.settings.samples),
      offsets_(context.settings.seed, context.settings.samples, context.settings.jitter),
      result_{Pixels(tile_.rect, context.settings.aovs), {}, {}},
      log_{context.tested.get(), counts_tests(context.settings) ? &result_.tests : nullptr} {
  if (tile_.first_level == FirstLevel::nothing) return;
  whitted_.emplace(*context.scene, context.plan.features, *context.accel, context.plan.max_depth, result_.rays, log_);
  if (tile_.first_level == FirstLevel::candidates) candidates_ = context.plan.tiling.candidates_of(tile_);
}

bool TileRenderer::go_on(Clock::time_point until, const std::stop_token& stop) {
  const StrictFloats strict;
  if (tile_.first_level == FirstLevel::nothing) {
    fill_with_background();
    return true;
  }
  // Costs are told apart by pixel.
  const std::size_t most_pixels = records_costs(context_.settings) ? 1 : kChunk;
  Clock::time_point now = Clock::now();
  do {
    if (samples_.empty()) {
      if (!order_.next(samples_at_once(), most_pixels, samples_)) {
        for (Rgb& color : result_.pixels.color) color = mean(color, context_.settings.samples);
        return true;
      }
      begin_chunk();
    } else if (!whitted_->go_on()) {
      end_chunk();
    }
    const Clock::time_point before = std::exchange(now, Clock::now());
    longest_batch_ = std::max(longest_batch_, now - before);
  } while (now < until && !stop.stop_requested());
  return false;
}

/// What structures count may depend on which rays go together: so it is always the same number of them, and few, as
/// those that are counted may cost much.
std::size_t TileRenderer::samples_at_once() const { return log_.counts ? kCountedChunk : context_.chunk->load(); }

void TileRenderer::fit_chunks() {
  const std::size_t size = samples_.size();
  if (longest_batch_ > kLongBatch)
    *context_.chunk = std::max<std::size_t>(1, size * kLongBatch / longest_batch_);
  else if (longest_batch_ < kLongBatch / 2 && size < kChunk && size == *context_.chunk)
    *context_.chunk = std::min(kChunk, 2 * size);
  longest_batch_ = {};
}

void TileRenderer::fill_with_background() {
  const std::uint32_t samples = context_.settings.samples;
  std::ranges::fill(result_.pixels.color, mean(sum_of_equal(context_.scene->background, samples), samples));
  samples_done_ = static_cast<std::uint64_t>(tile_.rect.area()) * samples;
  result_.rays.camera_skipped = samples_done_;
}

void TileRenderer::begin_chunk() {
  if (samples_.front().index == 0) before_pixel_ = result_.tests;
  trace_first_level();
  record_aovs();
  radiance_.resize(rays_.size());
  whitted_->begin(rays_, hits_, radiance_);
}

void TileRenderer::end_chunk() {
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    Rgb& sum = result_.pixels.color[pixel(samples_[i])];
    sum = sum + radiance_[i];
  }
  if (records_costs(context_.settings)) record_costs(pixel(samples_.front()));
  fit_chunks();
  samples_done_ += samples_.size();
  samples_.clear();
}

void TileRenderer::trace_first_level() {
  rays_.clear();
  directions_.clear();
  for (const Sample& s : samples_) {
    const PixelOffset offset = offsets_.of(static_cast<std::uint32_t>(s.x), static_cast<std::uint32_t>(s.y), s.index);
    rays_.push_back(context_.rays.ray(s.x + offset.x, s.y + offset.y));
    directions_.push_back(rays_.back().direction);
  }
  hits_.resize(rays_.size());
  if (context_.rays.is_perspective())
    context_.accel->closest_fan({context_.rays.eye(), directions_}, hits_, log_, candidates_);
  else
    context_.accel->closest(rays_, hits_, log_, candidates_);
  result_.rays.camera += rays_.size();
  result_.rays.camera_hits +=
      static_cast<std::uint64_t>(std::ranges::count_if(hits_, [](const Hit& hit) { return hit.t < kInfinity; }));
}

void TileRenderer::record_aovs() {
  Pixels& out = result_.pixels;
  if (out.aovs().empty()) return;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const Hit& hit = hits_[i];
    if (samples_[i].index != 0 || hit.t == kInfinity) continue;
    const std::size_t at = pixel(samples_[i]);
    out.record(Aov::depth, at, hit.t);  // a camera ray's t is depth
    out.record(Aov::primitive_id, at, hit.primitive);
    out.record(Aov::object_id, at, hit.object);
    if (out.has(Aov::normal))
      out.record(Aov::normal, at,
                 to_float(world_surface(*context_.scene, hit.object, hit.primitive, rays_[i], hit.t).shading_normal));
  }
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
