#include "core/render/render.h"

#include <utility>

#include "core/integrator/spawn.h"
#include "core/integrator/whitted.h"
#include "core/math/float_environment.h"
#include "core/sampling/pixel_samples.h"

namespace tessera {
namespace {

/// Renders one tile, pixel by pixel.
class TileRenderer {
 public:
  TileRenderer(const RenderContext& context, const Tile& tile, std::stop_token stop)
      : context_(context),
        tile_(tile),
        stop_(std::move(stop)),
        result_{Pixels(tile.rect, context.settings.aovs), {}, {}},
        log_{context.tested.get(), counts_tests(context.settings) ? &result_.tests : nullptr} {}

  std::optional<TileResult> run() {
    for (std::int32_t y = tile_.rect.y0; y < tile_.rect.y1; ++y)
      for (std::int32_t x = tile_.rect.x0; x < tile_.rect.x1; ++x)
        if (!pixel(x, y)) return std::nullopt;
    return std::move(result_);
  }

 private:
  /// The same sum and the same division, whether its samples were traced or known to be background (law L6). False
  /// when told to stop.
  bool pixel(std::int32_t x, std::int32_t y) {
    const std::uint32_t samples = context_.settings.samples;
    const TestCounts before = result_.tests;
    Rgb sum;
    for (std::uint32_t i = 0; i < samples; ++i) {
      sum = sum + sample(x, y, i);
      if (stop_.stop_requested()) return false;  // also when it was cut short by that
    }
    const auto n = static_cast<float>(samples);
    const std::size_t index = result_.pixels.index(x, y);
    result_.pixels.color[index] = {sum.r / n, sum.g / n, sum.b / n};
    record_costs(index, before);
    return true;
  }

  Rgb sample(std::int32_t x, std::int32_t y, std::uint32_t index) {
    if (tile_.first_level == FirstLevel::nothing) {
      ++result_.rays.camera_skipped;
      return context_.scene->background;
    }
    const Settings& settings = context_.settings;
    const PixelOffset offset = pixel_offset(settings.seed, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                                            index, settings.samples, settings.jitter);
    const Ray ray = context_.rays.ray(x + offset.x, y + offset.y);
    const std::optional<Hit> hit = first_hit(ray);
    ++result_.rays.camera;
    if (hit) ++result_.rays.camera_hits;
    if (hit && index == 0) record_aovs(result_.pixels.index(x, y), ray, *hit);
    return Whitted(*context_.scene, *context_.accel, settings.max_depth, result_.rays, log_, stop_).radiance(ray, hit);
  }

  std::optional<Hit> first_hit(const Ray& ray) const {
    if (tile_.first_level == FirstLevel::candidates)
      return context_.accel->closest_among(ray, context_.plan.tiling.candidates_of(tile_), log_);
    return context_.accel->closest(ray, log_);
  }

  void record_aovs(std::size_t pixel, const Ray& ray, const Hit& hit) {
    Pixels& out = result_.pixels;
    if (!out.depth.empty()) out.depth[pixel] = hit.t;  // a camera ray's t is depth
    if (!out.primitive_id.empty()) out.primitive_id[pixel] = hit.primitive;
    if (!out.object_id.empty()) out.object_id[pixel] = hit.object;
    if (!out.normal.empty())
      out.normal[pixel] =
          to_float(world_surface(*context_.scene, hit.object, hit.primitive, ray, hit.t).shading_normal);
  }

  /// What the pixel's rays have cost since the counts were `before`.
  void record_costs(std::size_t pixel, const TestCounts& before) {
    const auto mean = [&](std::uint64_t TestCounts::*count) {
      return static_cast<float>(static_cast<double>(result_.tests.*count - before.*count) / context_.settings.samples);
    };
    Pixels& out = result_.pixels;
    if (!out.cost_volumes.empty()) out.cost_volumes[pixel] = mean(&TestCounts::volume_tests);
    if (!out.cost_primitives.empty()) out.cost_primitives[pixel] = mean(&TestCounts::object_tests);
  }

  const RenderContext& context_;
  const Tile& tile_;
  std::stop_token stop_;
  TileResult result_;
  TraceLog log_;
};

}  // namespace

bool counts_tests(const Settings& settings) {
  return settings.count_tests || settings.aovs.contains(Aov::cost_volumes) ||
         settings.aovs.contains(Aov::cost_primitives);
}

std::optional<TileResult> render_tile(const RenderContext& context, std::size_t index, std::stop_token stop) {
  const StrictFloats strict;
  return TileRenderer(context, context.plan.tiling.tiles[index], std::move(stop)).run();
}

}  // namespace tessera
