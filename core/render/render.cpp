#include "core/render/render.h"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "core/integrator/spawn.h"
#include "core/integrator/whitted.h"
#include "core/math/float_environment.h"
#include "core/render/sample_order.h"
#include "core/sampling/pixel_samples.h"

namespace tessera {
namespace {

/// Samples that are traced together: enough for structures to gain from rays that go together, few enough for all that
/// is known of them to stay in the caches.
constexpr std::size_t kChunk = 1024;

bool records_costs(const Settings& settings) {
  return settings.aovs.contains(Aov::cost_volumes) || settings.aovs.contains(Aov::cost_primitives);
}

/// The same sum and the same division, whether samples were traced or known to be background (law L6).
Rgb mean(Rgb sum, std::uint32_t samples) {
  const auto n = static_cast<float>(samples);
  return {sum.r / n, sum.g / n, sum.b / n};
}

/// A tile that nothing projects into.
TileResult background_tile(const RenderContext& context, PixelRect rect) {
  TileResult result{Pixels(rect, context.settings.aovs), {}, {}};
  const std::uint32_t samples = context.settings.samples;
  Rgb sum;
  for (std::uint32_t i = 0; i < samples; ++i) sum = sum + context.scene->background;
  std::ranges::fill(result.pixels.color, mean(sum, samples));
  result.rays.camera_skipped = static_cast<std::uint64_t>(rect.area()) * samples;
  return result;
}

/// Renders one tile, a chunk of its samples at a time.
class TileRenderer {
 public:
  TileRenderer(const RenderContext& context, const Tile& tile, const std::stop_token& stop)
      : context_(context),
        stop_(stop),
        offsets_(context.settings.seed, context.settings.samples, context.settings.jitter),
        result_{Pixels(tile.rect, context.settings.aovs), {}, {}},
        log_{context.tested.get(), counts_tests(context.settings) ? &result_.tests : nullptr},
        whitted_(*context.scene, *context.accel, context.settings.max_depth, result_.rays, log_, stop) {
    if (tile.first_level == FirstLevel::candidates) candidates_ = context.plan.tiling.candidates_of(tile);
  }

  /// Once.
  std::optional<TileResult> run() {
    // Costs are told apart by pixel.
    const std::size_t most_pixels = records_costs(context_.settings) ? 1 : kChunk;
    SampleOrder order(result_.pixels.rect, context_.settings.samples);
    while (order.next(kChunk, most_pixels, samples_)) {
      render_chunk();
      if (stop_.stop_requested()) return std::nullopt;  // also when the chunk was cut short by that
    }
    for (Rgb& color : result_.pixels.color) color = mean(color, context_.settings.samples);
    return std::move(result_);
  }

 private:
  void render_chunk() {
    if (samples_.front().index == 0) before_pixel_ = result_.tests;
    trace_first_level();
    record_aovs();
    radiance_.resize(rays_.size());
    whitted_.radiance(rays_, hits_, radiance_);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      Rgb& sum = result_.pixels.color[pixel(samples_[i])];
      sum = sum + radiance_[i];
    }
    if (records_costs(context_.settings)) record_costs(pixel(samples_.front()));
  }

  void trace_first_level() {
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

  void record_aovs() {
    Pixels& out = result_.pixels;
    if (out.depth.empty() && out.primitive_id.empty() && out.object_id.empty() && out.normal.empty()) return;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const Hit& hit = hits_[i];
      if (samples_[i].index != 0 || hit.t == kInfinity) continue;
      const std::size_t at = pixel(samples_[i]);
      if (!out.depth.empty()) out.depth[at] = hit.t;  // a camera ray's t is depth
      if (!out.primitive_id.empty()) out.primitive_id[at] = hit.primitive;
      if (!out.object_id.empty()) out.object_id[at] = hit.object;
      if (!out.normal.empty())
        out.normal[at] =
            to_float(world_surface(*context_.scene, hit.object, hit.primitive, rays_[i], hit.t).shading_normal);
    }
  }

  /// What the rays of a pixel have cost so far, were they all.
  void record_costs(std::size_t at) {
    const auto per_sample = [&](std::uint64_t TestCounts::*count) {
      return static_cast<float>(static_cast<double>(result_.tests.*count - before_pixel_.*count) /
                                context_.settings.samples);
    };
    Pixels& out = result_.pixels;
    if (!out.cost_volumes.empty()) out.cost_volumes[at] = per_sample(&TestCounts::volume_tests);
    if (!out.cost_primitives.empty()) out.cost_primitives[at] = per_sample(&TestCounts::object_tests);
  }

  std::size_t pixel(const Sample& sample) const { return result_.pixels.index(sample.x, sample.y); }

  const RenderContext& context_;
  std::stop_token stop_;
  PixelOffsets offsets_;
  Candidates candidates_;
  TileResult result_;  ///< Colours are sums until all is traced.
  TraceLog log_;
  Whitted whitted_;
  TestCounts before_pixel_;
  // Of the chunk at hand.
  std::vector<Sample> samples_;
  std::vector<Ray> rays_;
  Directions directions_;
  std::vector<Hit> hits_;
  std::vector<Rgb> radiance_;
};

}  // namespace

bool counts_tests(const Settings& settings) { return settings.count_tests || records_costs(settings); }

std::optional<TileResult> render_tile(const RenderContext& context, std::size_t index, std::stop_token stop) {
  const StrictFloats strict;
  const Tile& tile = context.plan.tiling.tiles[index];
  if (stop.stop_requested()) return std::nullopt;
  if (tile.first_level == FirstLevel::nothing) return background_tile(context, tile.rect);
  return TileRenderer(context, tile, stop).run();
}

}  // namespace tessera
