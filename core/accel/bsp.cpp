#include <array>

#include "core/accel/convex_cell.h"
#include "core/accel/plane_tree.h"
#include "core/accel/plane_tree_builder.h"
#include "core/bounds/slab_presets.h"

namespace tessera {
namespace {

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
    if (at.items.size() <= 1 || at.depth >= most_depth_ || at.cell.corner_count() > kMostCorners) return std::nullopt;
    // Cutting the cell up to learn the parts' surfaces is what costs, so only the most promising planes come so far.
    std::vector<Candidate> candidates;
    const bool is_large = at.items.size() > kManyItems;
    for (std::size_t i = 0; i < (is_large ? 3 : directions_.size()); ++i) add_candidate(at, directions_[i], candidates);
    for (std::size_t i = 0; !is_large && i < kOwnPlanes; ++i)
      if (const auto normal = own_normal(at.items[i * at.items.size() / kOwnPlanes]))
        add_candidate(at, *normal, candidates);
    const std::size_t few = std::min(kClosestLook, candidates.size());
    std::ranges::partial_sort(candidates, candidates.begin() + static_cast<std::ptrdiff_t>(few), {}, &Candidate::cost);
    candidates.resize(few);
    for (Candidate& candidate : candidates) candidate.cost = cost_by_surface(at.cell, candidate);

    const auto best = std::ranges::min_element(candidates, {}, &Candidate::cost);
    if (best == candidates.end()) return std::nullopt;
    return if_worthwhile(best->plane, best->cost, at, leaf_size_);
  }

 private:
  static constexpr std::size_t kManyItems = 512;
  /// A cell of more corners costs more to cut than its items to test.
  static constexpr std::size_t kMostCorners = 512;
  static constexpr std::size_t kOwnPlanes = 4;
  static constexpr std::size_t kClosestLook = 3;
  static constexpr std::size_t kBins = 16;

  struct Candidate {
    FreePlane plane;
    std::size_t below, above;  ///< Items.
    double cost;               ///< In tests of an item; a guess at first.
  };

  std::optional<Vec3> own_normal(std::uint32_t item) const {
    const auto corners = items_.triangle(item);
    if (!corners) return std::nullopt;
    const auto& [a, b, c] = *corners;
    const Vec3d normal = cross(to_double(b) - to_double(a), to_double(c) - to_double(a));
    const double largest = max_component(abs(normal));
    if (!(largest > 0)) return std::nullopt;
    return to_float(normal / largest);
  }

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

  /// The best of a direction's planes, by a guess at the parts' surfaces: a quarter for the cut's own face, the rest by
  /// how far along the cell it lies.
  void add_candidate(const CellItems<ConvexCell>& at, Vec3 normal, std::vector<Candidate>& candidates) const {
    const auto [lo, hi] = at.cell.extent(normal);
    const double scale = kBins / (hi - lo);
    if (!(hi > lo) || !std::isfinite(hi - lo) || !std::isfinite(scale)) return;
    std::array<std::size_t, kBins> begins{}, ends{};
    const auto bin = [&, first = lo](double x) {
      return static_cast<std::size_t>(std::clamp((x - first) * scale, 0.0, kBins - 1.0));
    };
    for (const std::uint32_t item : at.items) {
      const Extent e = extent_along(item, normal);
      ++begins[bin(e.lo)];
      ++ends[bin(e.hi)];
    }
    Candidate best{{normal, 0}, 0, 0, kInfinity};
    std::size_t below = 0, above = at.items.size();
    for (std::size_t border = 1; border < kBins; ++border) {
      below += begins[border - 1];
      above -= ends[border - 1];
      const double share = static_cast<double>(border) / kBins;
      const double cost =
          (0.25 + 0.75 * share) * static_cast<double>(below) + (1 - 0.75 * share) * static_cast<double>(above);
      if (cost < best.cost)
        best = {{normal, static_cast<float>(lo + static_cast<double>(border) / scale)}, below, above, cost};
    }
    if (lo < best.plane.offset && best.plane.offset < hi) candidates.push_back(best);
  }

  static double cost_by_surface(const ConvexCell& cell, const Candidate& candidate) {
    const auto [lower, upper] = cell.parts(candidate.plane);
    const double surface = cell.half_surface();
    if (!(surface > 0)) return kInfinity;
    const double tests = (lower.half_surface() * static_cast<double>(candidate.below) +
                          upper.half_surface() * static_cast<double>(candidate.above)) /
                         surface;
    return cost_of_cut(tests, candidate.below, candidate.above);
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
