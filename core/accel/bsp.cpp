#include <array>

#include "core/accel/convex_cell.h"
#include "core/accel/plane_tree.h"
#include "core/accel/plane_tree_builder.h"
#include "core/bounds/slab_presets.h"

namespace tessera {
namespace {

/// What crossing a plane of any direction costs against testing an item.
constexpr double kStepCost = 0.4;
constexpr double kEmptyBonus = 0.8;

/// Takes the plane of the least surface area cost among many directions (Ize, Wald & Parker 2008): in large nodes the
/// three axes, in smaller ones also the diagonals of the 13-DOP (Kammaje & Mora 2007) and the planes of some of the
/// node's own triangles.
class BspChooser {
 public:
  using Plane = FreePlane;
  using Cell = ConvexCell;

  BspChooser(const Items& items, const AccelOptions& options)
      : items_(items),
        leaf_size_(options.leaf_size),
        most_depth_(options.max_depth != 0 ? options.max_depth : usual_depth(items.size())),
        directions_(slab_preset(13)) {}

  static ConvexCell root(const Aabb& box) { return ConvexCell(box); }

  Extent extent(std::uint32_t item, const FreePlane& plane) const {
    const Extent e = extent_along(item, plane.normal);
    return {e.lo - plane.offset, e.hi - plane.offset};
  }

  std::optional<Cut<FreePlane>> choose(const CellItems<ConvexCell>& at) const {
    if (at.items.size() <= 1 || at.depth >= most_depth_) return std::nullopt;
    Best best;
    const bool is_large = at.items.size() > kManyItems;
    for (std::size_t i = 0; i < (is_large ? 3 : directions_.size()); ++i) try_direction(at, directions_[i], best);
    if (!is_large)
      for (std::size_t i = 0; i < kOwnPlanes; ++i) {
        const auto corners = items_.triangle(at.items[i * at.items.size() / kOwnPlanes]);
        if (!corners) continue;
        const Vec3d normal = cross(to_double((*corners)[1]) - to_double((*corners)[0]),
                                   to_double((*corners)[2]) - to_double((*corners)[0]));
        const double largest = max_component(abs(normal));
        if (largest > 0) try_direction(at, to_float(normal / largest), best);
      }
    const auto leaf_cost = static_cast<double>(at.items.size());
    const bool pays = best.cost < leaf_cost;
    if (best.cost == kInfinity || (!pays && at.items.size() <= leaf_size_)) return std::nullopt;
    if (!pays && (best.cost > 4 * leaf_cost || at.bad_cuts >= kMostBadCuts)) return std::nullopt;
    return Cut<FreePlane>{best.plane, !pays};
  }

 private:
  static constexpr std::size_t kManyItems = 512;
  static constexpr std::size_t kOwnPlanes = 4;
  static constexpr std::size_t kBins = 16;
  static constexpr std::uint32_t kMostBadCuts = 3;

  struct Best {
    FreePlane plane;
    double cost = kInfinity;  ///< In tests of an item.
  };

  /// Exact for triangles but for the rounding of a dot product in double; by the box for everything else.
  Extent extent_along(std::uint32_t item, Vec3 n) const {
    if (const auto corners = items_.triangle(item)) {
      const double a = dot(to_double(n), to_double((*corners)[0])), b = dot(to_double(n), to_double((*corners)[1])),
                   c = dot(to_double(n), to_double((*corners)[2]));
      return {std::min({a, b, c}), std::max({a, b, c})};
    }
    const Aabb& box = items_.boxes()[item];
    Extent e{0, 0};
    for (int axis = 0; axis < 3; ++axis) {
      const double a = static_cast<double>(n[axis]) * box.lo[axis], b = static_cast<double>(n[axis]) * box.hi[axis];
      e.lo += std::min(a, b);
      e.hi += std::max(a, b);
    }
    return e;
  }

  /// The best of a direction's planes by a guess at the parts' surfaces; its cost by the surfaces themselves.
  void try_direction(const CellItems<ConvexCell>& at, Vec3 normal, Best& best) const {
    const auto [lo, hi] = at.cell.extent(normal);
    const double scale = kBins / (hi - lo);
    if (!(hi > lo) || !std::isfinite(scale)) return;
    std::array<std::size_t, kBins> begins{}, ends{};
    const auto bin = [&, first = lo](double x) {
      return static_cast<std::size_t>(std::clamp((x - first) * scale, 0.0, kBins - 1.0));
    };
    for (const std::uint32_t item : at.items) {
      const Extent e = extent_along(item, normal);
      ++begins[bin(e.lo)];
      ++ends[bin(e.hi)];
    }
    double least = kInfinity;
    std::size_t least_border = 0, below = 0, above = at.items.size(), least_below = 0, least_above = 0;
    for (std::size_t border = 1; border < kBins; ++border) {
      below += begins[border - 1];
      above -= ends[border - 1];
      const double share = static_cast<double>(border) / kBins;
      const double guess =
          (0.25 + 0.75 * share) * static_cast<double>(below) + (1 - 0.75 * share) * static_cast<double>(above);
      if (guess < least) {
        least = guess;
        least_border = border;
        least_below = below;
        least_above = above;
      }
    }
    const FreePlane plane{normal, static_cast<float>(lo + static_cast<double>(least_border) / scale)};
    if (!(lo < plane.offset && plane.offset < hi)) return;
    const auto [lower, upper] = at.cell.parts(plane);
    const double surface = at.cell.half_surface();
    if (!(surface > 0)) return;
    const double tests = (lower.half_surface() * static_cast<double>(least_below) +
                          upper.half_surface() * static_cast<double>(least_above)) /
                         surface;
    const double cost = kStepCost + (least_below == 0 || least_above == 0 ? kEmptyBonus : 1) * tests;
    if (cost < best.cost) best = {plane, cost};
  }

  const Items& items_;
  std::uint32_t leaf_size_;
  std::uint32_t most_depth_;
  std::vector<Vec3> directions_;
};

}  // namespace

PlaneNodes<FreePlane> build_bsp(const Items& items, const AccelOptions& options) {
  return PlaneTreeBuilder(items, BspChooser(items, options)).build();
}

}  // namespace tessera
