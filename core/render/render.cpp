#include "core/render/render.h"

#include "core/render/tile_renderer.h"

namespace tessera {

std::optional<TileResult> render_tile(const RenderContext& context, std::size_t index, std::stop_token stop) {
  if (stop.stop_requested()) return std::nullopt;
  TileRenderer tile(context, index);
  if (!tile.go_on(TileRenderer::Clock::time_point::max(), stop)) return std::nullopt;
  return tile.take_result();
}

}  // namespace tessera
