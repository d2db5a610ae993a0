#include "core/screen/tiling.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "core/sampling/pixel_filter.h"
#include "core/screen/screen_parts.h"
#include "core/screen/screen_rect.h"
#include "core/screen/screen_tree.h"

namespace tessera {
namespace {

using Ids = std::vector<std::uint32_t>;

/// Tiles of the adaptive cut that aren't empty: at most this many pixels on a side, and cut no further below that.
constexpr std::int32_t kLargestSide = 64;
constexpr std::int32_t kSmallestSide = 8;
/// Tiles that are covered, with more objects than a list of candidates pays for, are cut no further below that: smaller
/// ones would hold fewer rays that go together, and hardly ever so few objects.
constexpr std::int32_t kCrowdedSide = 32;

/// Cuts rectangles in two until each is a tile. What is in them is asked of `parts`; where that is null, of the areas
/// of whole objects.
class Cutter {
 public:
  Cutter(const Scene& scene, std::span<const PixelRect> areas, const ScreenTree* parts, const Settings& settings,
         Tiling& out)
      : areas_(areas), parts_(parts), settings_(settings), out_(out) {
    // A list of candidates pays as long as testing each one's box costs less than walking a tree over all objects.
    most_candidates_ = 2 + static_cast<std::size_t>(2 * std::log2(1.0 + static_cast<double>(scene.objects.size())));
  }

  void cut(PixelRect rect, const Ids& ids) {
    if (is_tile(rect, ids)) return add(rect, ids);
    const auto [first, second] = halves(rect);
    for (const PixelRect& half : {first, second}) cut(half, objects_in(half, ids));
  }

 private:
  /// Candidates of all tiles together: 64 MiB of them. Tiles beyond search the whole structure.
  static constexpr std::size_t kMostListed = 1 << 24;

  /// The objects among `ids` that project into `rect`; of too many candidates, not all.
  Ids objects_in(PixelRect rect, const Ids& ids) const {
    if (parts_) return parts_->objects_in(rect, most_candidates_);
    Ids inside;
    std::ranges::copy_if(ids, std::back_inserter(inside), [&](auto id) { return overlap(areas_[id], rect); });
    return inside;
  }

  bool is_tile(PixelRect rect, const Ids& ids) const {
    const std::int32_t side = std::max(rect.width(), rect.height());
    if (settings_.tile_size != kAdaptiveTiles) return side <= static_cast<std::int64_t>(settings_.tile_size);
    if (settings_.screen_bounds == ScreenBounds::off) return side <= kLargestSide;
    if (ids.empty()) return true;
    if (side > kLargestSide) return false;
    if (side <= kSmallestSide) return true;
    return (ids.size() <= most_candidates_ || side <= kCrowdedSide) && mostly_covered(rect, ids);
  }

  /// Whether cutting on would free little of the tile.
  bool mostly_covered(PixelRect rect, const Ids& ids) const {
    if (parts_) return parts_->covers_half(rect);
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
  const ScreenTree* parts_;
  const Settings& settings_;
  Tiling& out_;
  std::size_t most_candidates_;
};

}  // namespace

Tiling make_tiling(const Scene& scene, const Camera& seen_by, const Settings& settings) {
  const double beyond = std::max(0.0, PixelFilter(settings.filter, settings.filter_width).reach() - 0.5);
  const CameraRays camera(seen_by, settings.width, settings.height, beyond);
  const PixelRect image{0, 0, static_cast<std::int32_t>(settings.width), static_cast<std::int32_t>(settings.height)};
  Tiling out;
  std::vector<PixelRect> areas;
  std::optional<ScreenTree> parts;
  Ids on_screen;
  if (settings.screen_bounds == ScreenBounds::off) {
    out.objects_on_screen = scene.objects.size();
  } else {
    areas.reserve(scene.objects.size());
    const std::vector<Aabb> boxes = world_bounds(scene);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const auto& placement = scene.objects[i].placement;
      areas.push_back(screen_rect(boxes[i], camera, placement ? placement->error() : Transform::Error{}));
    }
    if (settings.screen_bounds == ScreenBounds::hierarchical) {
      std::vector<ScreenPart> seen = screen_parts(scene, camera, areas, kSmallestSide);
      for (const ScreenPart& part : seen)  // an object's parts come together
        if (on_screen.empty() || on_screen.back() != part.object) on_screen.push_back(part.object);
      parts.emplace(std::move(seen));
    } else {
      for (std::uint32_t i = 0; i < areas.size(); ++i)
        if (!areas[i].empty()) on_screen.push_back(i);
    }
    out.objects_on_screen = on_screen.size();
  }
  Cutter(scene, areas, parts ? &*parts : nullptr, settings, out).cut(image, on_screen);
  return out;
}

}  // namespace tessera
