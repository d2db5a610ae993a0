#include "core/screen/tiling.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/screen/screen_rect.h"

namespace tessera {
namespace {

using Ids = std::vector<std::uint32_t>;

/// Cuts rectangles in two until each is a tile.
class Cutter {
 public:
  Cutter(const Scene& scene, std::span<const PixelRect> areas, const Settings& settings, Tiling& out)
      : areas_(areas), settings_(settings), out_(out) {
    // A list of candidates pays as long as testing each one's box costs less than walking a tree over all objects.
    most_candidates_ = 2 + static_cast<std::size_t>(2 * std::log2(1.0 + static_cast<double>(scene.objects.size())));
  }

  void cut(PixelRect rect, const Ids& ids) {
    if (is_tile(rect, ids)) return add(rect, ids);
    const auto [first, second] = halves(rect);
    for (const PixelRect& half : {first, second}) {
      Ids inside;
      std::ranges::copy_if(ids, std::back_inserter(inside), [&](auto id) { return overlap(areas_[id], half); });
      cut(half, inside);
    }
  }

 private:
  /// Tiles of the adaptive cut that aren't empty: at most this many pixels on a side, and cut no further below that.
  static constexpr std::int32_t kLargestSide = 64;
  static constexpr std::int32_t kSmallestSide = 8;

  /// Candidates of all tiles together: 64 MiB of them. Tiles beyond search the whole structure.
  static constexpr std::size_t kMostListed = 1 << 24;

  bool is_tile(PixelRect rect, const Ids& ids) const {
    const std::int32_t side = std::max(rect.width(), rect.height());
    if (settings_.tile_size != kAdaptiveTiles) return side <= static_cast<std::int64_t>(settings_.tile_size);
    if (settings_.screen_bounds == ScreenBounds::off) return side <= kLargestSide;
    if (ids.empty()) return true;
    if (side > kLargestSide) return false;
    return side <= kSmallestSide || (ids.size() <= most_candidates_ && mostly_covered(rect, ids));
  }

  /// Whether cutting on would free little of the tile.
  bool mostly_covered(PixelRect rect, const Ids& ids) const {
    PixelRect covered = intersect(rect, areas_[ids[0]]);
    for (const std::uint32_t id : ids) {
      const PixelRect area = intersect(rect, areas_[id]);
      covered = {std::min(covered.x0, area.x0), std::min(covered.y0, area.y0), std::max(covered.x1, area.x1),
                 std::max(covered.y1, area.y1)};
    }
    return covered.area() * 2 >= rect.area();
  }

  /// Halves of the longer side. Fixed tiles are cut on multiples of their size, so that they form a grid.
  std::pair<PixelRect, PixelRect> halves(PixelRect r) const {
    const std::int32_t unit =
        settings_.tile_size == kAdaptiveTiles ? 1 : static_cast<std::int32_t>(settings_.tile_size);
    const auto middle = [unit](std::int32_t lo, std::int32_t hi) {
      return lo + std::max((hi - lo) / 2 / unit, 1) * unit;
    };
    if (r.width() >= r.height()) {
      const std::int32_t x = middle(r.x0, r.x1);
      return {{r.x0, r.y0, x, r.y1}, {x, r.y0, r.x1, r.y1}};
    }
    const std::int32_t y = middle(r.y0, r.y1);
    return {{r.x0, r.y0, r.x1, y}, {r.x0, y, r.x1, r.y1}};
  }

  void add(PixelRect rect, const Ids& ids) {
    if (settings_.screen_bounds == ScreenBounds::off) {
      out_.tiles.push_back({rect, FirstLevel::structure, 0, 0});
    } else if (ids.empty()) {
      out_.tiles.push_back({rect, FirstLevel::nothing, 0, 0});
    } else if (ids.size() > most_candidates_ || out_.candidates.size() + ids.size() > kMostListed) {
      out_.tiles.push_back({rect, FirstLevel::structure, 0, 0});
    } else {
      out_.tiles.push_back({rect, FirstLevel::candidates, static_cast<std::uint32_t>(out_.candidates.size()),
                            static_cast<std::uint32_t>(ids.size())});
      out_.candidates.insert(out_.candidates.end(), ids.begin(), ids.end());
    }
  }

  std::span<const PixelRect> areas_;
  const Settings& settings_;
  Tiling& out_;
  std::size_t most_candidates_;
};

}  // namespace

Tiling make_tiling(const Scene& scene, const CameraRays& camera, const Settings& settings) {
  const PixelRect image{0, 0, static_cast<std::int32_t>(settings.width), static_cast<std::int32_t>(settings.height)};
  Tiling out;
  std::vector<PixelRect> areas;
  Ids on_screen;
  if (settings.screen_bounds == ScreenBounds::off) {
    out.objects_on_screen = scene.objects.size();
  } else {
    areas.reserve(scene.objects.size());
    for (const Object& object : scene.objects) {
      areas.push_back(screen_rect(world_bounds(scene, object), camera,
                                  object.placement ? object.placement->error() : Transform::Error{}));
      if (!areas.back().empty()) on_screen.push_back(static_cast<std::uint32_t>(areas.size() - 1));
    }
    out.objects_on_screen = on_screen.size();
  }
  Cutter(scene, areas, settings, out).cut(image, on_screen);
  return out;
}

}  // namespace tessera
