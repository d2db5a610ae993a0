#include "tests/benchmarks/support/render_image.h"

#include <atomic>
#include <thread>
#include <vector>

#include "tests/benchmarks/support/samples.h"

namespace tessera::bench {

RenderContext prepare(std::shared_ptr<const Scene> scene, const Camera& camera, const Settings& settings) {
  Plan plan = make_plan(*scene, camera, settings);
  std::shared_ptr<const Accel> accel = make_accel(scene, plan.accel);
  return {std::move(scene), std::move(accel), settings, std::move(plan),
          CameraRays(camera, settings.width, settings.height)};
}

RenderTime render(const RenderContext& context, unsigned threads) {
  std::vector<PixelRect> rects;
  for (const Tile& tile : context.plan.tiling.tiles) rects.push_back(tile.rect);
  const Stopwatch watch;
  Film film(context.settings.width, context.settings.height, context.settings.aovs, rects);
  std::atomic<std::size_t> next{0};
  std::vector<RayCounts> counts(threads);
  {
    std::vector<std::jthread> pool;
    for (RayCounts& mine : counts)
      pool.emplace_back([&] {
        RayCounts sum;  // on its own cache line
        for (std::size_t i; (i = next++) < rects.size();) {
          const auto tile = render_tile(context, i);
          film.store(i, tile->pixels);
          sum += tile->rays;
        }
        mine = sum;
      });
  }
  RenderTime out{watch.seconds(), {}};
  for (const RayCounts& c : counts) out.rays += c;
  return out;
}

}  // namespace tessera::bench
