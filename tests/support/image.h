#pragma once

#include <algorithm>
#include <atomic>
#include <cstring>
#include <thread>
#include <variant>
#include <vector>

#include "core/render/render.h"

namespace tessera {

struct Image {
  Pixels pixels;
  RayCounts rays;
};

/// Renders a whole image, with a structure over the scene, on `threads` threads that take tiles as they come.
inline Image render_image(std::shared_ptr<const Scene> scene, std::shared_ptr<const Accel> accel, const Plan& plan,
                          const Camera& camera, const Settings& settings, int threads = 1) {
  const RenderContext context{scene, accel, settings, plan, CameraRays(camera, settings.width, settings.height)};
  std::vector<PixelRect> rects;
  for (const Tile& tile : context.plan.tiling.tiles) rects.push_back(tile.rect);
  Film film(settings.width, settings.height, settings.aovs, rects);
  std::atomic<std::size_t> next{0};
  std::vector<RayCounts> counts(static_cast<std::size_t>(threads));
  {
    std::vector<std::jthread> pool;
    for (RayCounts& mine : counts)
      pool.emplace_back([&] {
        for (std::size_t i; (i = next++) < rects.size();) {
          const auto tile = render_tile(context, i);
          film.store(i, tile->pixels);
          mine += tile->rays;
        }
      });
  }
  RayCounts rays;
  for (const RayCounts& c : counts) rays += c;
  return {film.pixels(), rays};
}

/// With the structure that the plan settles on.
inline Image render_image(std::shared_ptr<const Scene> scene, const Camera& camera, const Settings& settings,
                          int threads = 1) {
  const Plan plan = make_plan(*scene, camera, settings);
  return render_image(scene, make_accel(scene, plan.accel), plan, camera, settings, threads);
}

/// Byte for byte, NaN and −0 included.
inline bool same_bytes(const Pixels& a, const Pixels& b) {
  const auto same = [](const auto& x, const auto& y) {
    if (x.size() != y.size()) return false;
    return x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0;
  };
  if (!same(a.color, b.color) || a.aovs() != b.aovs()) return false;
  return std::ranges::all_of(a.aovs(), [&](Aov aov) {
    return std::visit([&]<typename T>(const std::vector<T>& values) { return same(values, b.plane<T>(aov)); },
                      a.values(aov));
  });
}

}  // namespace tessera
