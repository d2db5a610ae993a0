#include "core/render/render.h"

#include <utility>

#include "core/render/tile_renderer.h"

namespace tessera {

std::optional<TileResult> render_tile(const RenderContext& context, std::size_t index, PassWork work,
                                      std::stop_token stop) {
  if (stop.stop_requested()) return std::nullopt;
  TileRenderer tile(context, index, std::move(work));
  if (!tile.go_on(TileRenderer::Clock::time_point::max(), stop)) return std::nullopt;
  return tile.take_result();
}

std::optional<TileResult> render_tile(const RenderContext& context, std::size_t index, std::stop_token stop) {
  const Settings& settings = context.settings;
  auto pass = std::make_shared<const Pass>(settings.width, settings.height, SampleRange{0, settings.samples});
  return render_tile(context, index, {std::move(pass), context.plan.tiling.tiles[index].rect, settings},
                     std::move(stop));
}

}  // namespace tessera
