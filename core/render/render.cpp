#include "core/render/render.h"

#include <utility>

#include "core/math/float_environment.h"
#include "core/render/tile_renderer.h"

namespace tessera {
namespace {

std::shared_ptr<const LightTable> lights_for(const Plan& plan, const std::shared_ptr<const Scene>& scene) {
  return needs_lights(plan) ? make_lights(scene) : nullptr;
}

}  // namespace

RenderContext::RenderContext(std::shared_ptr<const Scene> of, std::shared_ptr<const Accel> structure,
                             const Settings& how, Plan planned, const CameraRays& camera)
    : RenderContext(of, std::move(structure), how, planned, camera, lights_for(planned, of)) {}

RenderContext::RenderContext(std::shared_ptr<const Scene> of, std::shared_ptr<const Accel> structure,
                             const Settings& how, Plan planned, const CameraRays& camera,
                             std::shared_ptr<const LightTable> made)
    : scene(std::move(of)),
      accel(std::move(structure)),
      settings(how),
      plan(std::move(planned)),
      rays(camera),
      sampler({plan.sampler, settings.seed, settings.samples, settings.jitter, measures_error(settings) ? 2U : 1U}),
      filter(settings.filter, settings.filter_width),
      lights(std::move(made)) {}

std::optional<TileResult> render_tile(const RenderContext& context, std::size_t index, PassWork work,
                                      std::stop_token stop) {
  if (stop.stop_requested()) return std::nullopt;
  TileRenderer tile(context, index, std::move(work));
  if (!tile.go_on([&] { return stop.stop_requested(); })) return std::nullopt;
  tile.finish();
  return tile.take_result();
}

std::optional<TileResult> render_tile(const RenderContext& context, std::size_t index, std::stop_token stop) {
  const Settings& settings = context.settings;
  auto pass = std::make_shared<const Pass>(settings.width, settings.height, SampleRange{0, settings.samples});
  return render_tile(context, index, {std::move(pass), context.plan.tiling.tiles[index].rect, settings},
                     std::move(stop));
}

}  // namespace tessera
