#include "core/light/light_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "core/math/rounding.h"

namespace tessera {
namespace {

// A branch's link: the light that it is, or the node that it leads to, whether it emits on both sides, and whether it
// and its neighbour are two pieces of one flat light: then their shares are those of their intensities, from
// everywhere.
constexpr std::uint32_t kIsLight = 0x80000000, kBothSides = 0x40000000, kIsPiece = 0x20000000, kIndex = 0x1FFFFFFF;

/// Of what cosines are kept in. They are rounded down, unless rounding alone makes them less than whole.
constexpr double kCosineUnit = 127, kNearlyWhole = 0x1p-10;

/// A cosine is known to less than this: an axis is kept to 2^-9, a spread and a box are never too small. Lights count
/// as dark only where they are by more, and as dim at most this much, so that what rounding hides of a light's
/// importance can't make its samples weigh more than that.
constexpr double kSlack = 0x1p-8;

/// The least square of the distance to a branch, as a part of that to its farthest place: about the mean of 1/d² over a
/// disk or a ball for points in it.
constexpr double kNearest = 1.0 / 12;

constexpr double kTotalIntensity = 0x1p100;

/// From here on a subtree's lights are halved, so that a way has less than 64 levels.
constexpr int kMostHeuristicLevels = 32;

constexpr std::uint32_t kBins = 12;

constexpr int kAxisBits = 10;
constexpr double kAxisUnit = (1 << (kAxisBits - 1)) - 1;

std::uint32_t packed(Vec3d axis) {
  std::uint32_t bits = 0;
  for (int i = 0; i < 3; ++i)
    bits |= static_cast<std::uint32_t>(std::floor((axis[i] + 1) * kAxisUnit + 0.5)) << (i * kAxisBits);
  return bits;
}
Vec3d unpacked(std::uint32_t bits) {
  const auto part = [&](int i) {
    return static_cast<double>(bits >> (i * kAxisBits) & ((1 << kAxisBits) - 1)) * (1 / kAxisUnit) - 1;
  };
  return {part(0), part(1), part(2)};
}

/// Not less than `size`, which is ≥ 0.
std::uint16_t upper_half(float size) {
  return static_cast<std::uint16_t>((std::bit_cast<std::uint32_t>(size) + 0xFFFF) >> 16);
}
double from_upper_half(std::uint16_t half) { return std::bit_cast<float>(std::uint32_t{half} << 16); }

/// The other side of a right triangle, from squares.
double leg(double hypotenuse, double side) { return std::sqrt(std::max(0.0, hypotenuse - side)); }

/// An angle in [0, π], by two sides of a triangle: their lengths count for nothing.
struct Angle {
  double cos, sin;

  Angle operator-(Angle other) const { return {cos * other.cos + sin * other.sin, sin * other.cos - cos * other.sin}; }
};

}  // namespace

/// A branch may send I cos θ' cos θi' / d² (Conty Estevez & Kulla 2018, eq. 3), the angles being the least that there
/// are for points in the sphere around its box, and d between the distances of its nearest place and its centre.
double LightTree::importance(const Branch& branch, Vec3d point, Vec3d normal) {
  const Vec3d way = to_double(branch.center) - point, away = abs(way);
  const Vec3d half{from_upper_half(branch.half_size[0]), from_upper_half(branch.half_size[1]),
                   from_upper_half(branch.half_size[2])};
  const Vec3d nearest = max(away - half, Vec3d{}), farthest = away + half;
  const double near = dot(nearest, nearest), far = dot(farthest, farthest), square = dot(way, way);
  double weight = branch.intensity / std::max({(near + square) / 2, far * kNearest, 1e-100});

  const double radius = dot(half, half);  // squared
  if (square <= radius) return weight;
  const double inverse = 1 / square;
  const Angle around{std::sqrt(square - radius), std::sqrt(radius)};
  // The cosine of what `around` leaves of an angle; both by sides of triangles that the distance is the hypotenuse of.
  const auto cosine_of_rest = [&](Angle angle) {
    if (angle.sin < 0) return 1.0;
    const Angle rest = angle - around;
    return rest.sin < 0 ? 1.0 : rest.cos * inverse;
  };
  if (branch.cos_spread > -kCosineUnit) {
    double along = -dot(way, unpacked(branch.axis));
    if (branch.link & kBothSides) along = std::abs(along);
    Angle angle{along, leg(square, along * along)};
    if (branch.cos_spread < kCosineUnit) {
      const double spread = branch.cos_spread * (1 / kCosineUnit);
      angle = angle - Angle{spread, leg(1, spread * spread)};
    }
    const double cosine = cosine_of_rest(angle);
    if (cosine < branch.cos_reach * (1 / kCosineUnit) - kSlack) return 0;
    weight *= std::max(cosine, kSlack);
  }
  if (normal != Vec3d{}) {
    const double along = dot(way, normal);
    const double cosine = cosine_of_rest({along, leg(square, along * along)});
    if (cosine < -kSlack) return 0;
    weight *= std::max(cosine, kSlack);
  }
  return weight;
}

LightTree::Shares LightTree::shares(const Node& node, Vec3d point, Vec3d normal) {
  if (node.branches[0].link & kIsPiece) {
    const double a = node.branches[0].intensity, b = node.branches[1].intensity;
    return {{a / (a + b), b / (a + b)}};
  }
  const double first = importance(node.branches[0], point, normal);
  const double second = importance(node.branches[1], point, normal);
  if (!(first + second > 0)) return {{0.5, 0.5}};
  const double inverse = 1 / (first + second);
  return {{first * inverse, second * inverse}};
}

LightTree::Picked LightTree::pick(Vec3d point, Vec3 normal, double pick) const {
  if (size_ == 1) return {only_, 1, pick};
  const Vec3d side = to_double(normal);
  double probability = 1;
  std::uint32_t link = 0;
  do {
    const Node& node = nodes_[link & kIndex];
    const Shares share = shares(node, point, side);
    const bool second = pick >= share.of[0];
    pick = std::min((second ? pick - share.of[0] : pick) / share.of[second], 1 - 0x1p-53);
    probability *= share.of[second];
    link = node.branches[second].link;
  } while (!(link & kIsLight));
  return {link & kIndex, probability, pick};
}

double LightTree::irradiance(Vec3d point, Vec3 normal) const {
  const Vec3d side = to_double(normal);
  double sum = importance(nodes_[0].branches[0], point, side);
  if (size_ > 1) sum += importance(nodes_[0].branches[1], point, side);
  return sum * unit_;
}

double LightTree::probability(std::uint32_t light, Vec3d point, Vec3 normal) const {
  const Vec3d side = to_double(normal);
  std::uint64_t way = ways_[light];
  double probability = way == 0 ? 0 : 1;
  for (std::uint32_t link = 0; way > 1; way >>= 1) {
    const Node& node = nodes_[link & kIndex];
    const bool second = way & 1;
    probability *= shares(node, point, side).of[second];
    link = node.branches[second].link;
  }
  return probability;
}

/// Splits lights by the surface area orientation heuristic (Conty Estevez & Kulla 2018, sect. 4.2), the area being that
/// of the sphere around a box, as importance knows no other.
class LightTree::Builder {
 public:
  Builder(LightTree& tree, std::span<const LightBounds> lights) : tree_(tree) {
    double total = 0;
    for (std::uint32_t i = 0; i < lights.size(); ++i) {
      if (!(lights[i].intensity > 0)) continue;
      items_.push_back({lights[i], to_double(lights[i].box.lo) + to_double(lights[i].box.hi), i});
      total += lights[i].intensity;
    }
    scale_ = kTotalIntensity / total;
    tree_.unit_ = total / kTotalIntensity;
    tree_.size_ = static_cast<std::uint32_t>(items_.size());
    tree_.ways_.assign(lights.size(), 0);
    if (items_.empty()) return;
    second_.reserve(items_.size());
    tree_.nodes_.reserve(items_.size() - 1);
    if (items_.size() == 1) {
      tree_.nodes_.emplace_back();
      tree_.nodes_[0].branches[0] = branch_of(items_);
      tree_.only_ = items_[0].light;
      tree_.ways_[tree_.only_] = 1;
    } else {
      make_node(items_, 0, 0);
    }
  }

 private:
  struct Item {
    LightBounds bounds;
    Vec3d place;  ///< Twice the box's centre.
    std::uint32_t light;
  };
  using Items = std::span<Item>;

  /// Lights of which the axes are not bounded yet.
  struct Sum {
    Aabb box;
    Vec3d axes;
    double intensity = 0;
    EmissionCone cone;
    std::uint32_t count = 0;

    void add(const LightBounds& b) {
      box.extend(b.box);
      const Vec3d axis = to_double(b.axis);
      axes = b.both_sides && dot(axes, axis) < 0 ? axes - axis : axes + axis;
      intensity += b.intensity;
      ++count;
    }
    void begin_cone() { cone = EmissionCone::around(axes); }
    void merge(const Sum& other) {
      if (other.count == 0) return;
      box.extend(other.box);
      cone = count == 0 ? other.cone : united(cone, other.cone);
      intensity += other.intensity;
      count += other.count;
    }
    double cost() const {
      const Vec3d d = to_double(box.hi) - to_double(box.lo);
      return intensity * cone.measure() * dot(d, d);
    }
  };

  Sum sum_of(Items items) const {
    Sum sum;
    for (const Item& item : items) sum.add(item.bounds);
    sum.begin_cone();
    for (const Item& item : items) sum.cone.extend(item.bounds);
    return sum;
  }

  std::uint32_t make_node(Items items, int level, std::uint64_t way) {
    const auto index = static_cast<std::uint32_t>(tree_.nodes_.size());
    tree_.nodes_.emplace_back();
    const std::size_t middle = split(items, level);
    const Items halves[] = {items.first(middle), items.subspan(middle)};
    for (std::uint64_t second = 0; second < 2; ++second) {
      Branch branch = branch_of(halves[second]);
      const std::uint64_t there = way | second << level;
      if (halves[second].size() == 1) {
        const std::uint32_t light = halves[second][0].light;
        branch.link |= kIsLight | light;
        tree_.ways_[light] = there | std::uint64_t{2} << level;
      } else {
        branch.link |= make_node(halves[second], level + 1, there);
      }
      tree_.nodes_[index].branches[second] = branch;
    }
    if (items.size() == 2 && are_pieces(items[0].bounds, items[1].bounds))
      tree_.nodes_[index].branches[0].link |= kIsPiece;
    return index;
  }

  /// Whether they face the same way, and lie side by side.
  static bool are_pieces(const LightBounds& a, const LightBounds& b) {
    constexpr float kSameWay = 0.999F;
    if (a.both_sides != b.both_sides || std::min(a.cos_spread, b.cos_spread) < kSameWay ||
        std::min(a.cos_reach, b.cos_reach) != std::max(a.cos_reach, b.cos_reach) || dot(a.axis, b.axis) < kSameWay)
      return false;
    Aabb both = a.box;
    both.extend(b.box);
    return length(both.diagonal()) <= length(a.box.diagonal()) + length(b.box.diagonal());
  }

  Branch branch_of(Items items) const {
    const Sum sum = sum_of(items);
    const Vec3d lo = to_double(sum.box.lo), hi = to_double(sum.box.hi);
    Branch branch{};
    branch.center = to_float((lo + hi) * 0.5);
    const Vec3d c = to_double(branch.center);
    const Vec3d half = max(hi - c, c - lo);
    for (int i = 0; i < 3; ++i) branch.half_size[i] = half[i] > 0 ? upper_half(above(half[i])) : 0;
    branch.axis = packed(sum.cone.axis);
    branch.cos_spread = static_cast<std::int8_t>(std::floor(sum.cone.cos_spread * kCosineUnit + kNearlyWhole));
    branch.cos_reach = static_cast<std::int8_t>(std::floor(sum.cone.cos_reach * kCosineUnit + kNearlyWhole));
    branch.intensity = std::max(static_cast<float>(sum.intensity * scale_), std::numeric_limits<float>::min());
    branch.link = sum.cone.both_sides ? kBothSides : 0;
    return branch;
  }

  /// Reorders the items; how many of them, neither none nor all, are the first half.
  std::size_t split(Items items, int level) {
    if (items.size() == 2) return 1;
    Vec3d lo = items[0].place, hi = lo;
    for (const Item& item : items) {
      lo = min(lo, item.place);
      hi = max(hi, item.place);
    }
    const Vec3d extent = hi - lo;
    const double longest = max_component(extent);
    if (longest > 0 && level < kMostHeuristicLevels) {
      const Cut cut = best_cut(items, lo, extent);
      if (cut.axis >= 0) {
        const double scale = cut.bins / extent[cut.axis];
        return part(items, [&](const Item& item) { return bin_of(item, cut.axis, lo, scale, cut.bins) < cut.bin; });
      }
    }
    const int axis = extent.x == longest ? 0 : extent.y == longest ? 1 : 2;
    std::ranges::sort(items, [&](const Item& a, const Item& b) {
      return a.place[axis] != b.place[axis] ? a.place[axis] < b.place[axis] : a.light < b.light;
    });
    return items.size() / 2;
  }

  /// Items below a bin on one side, the rest on the other.
  struct Cut {
    int axis = -1;
    std::uint32_t bin = 0, bins = 0;
    double cost = std::numeric_limits<double>::infinity();
  };

  static std::uint32_t bin_of(const Item& item, int axis, Vec3d lo, double scale, std::uint32_t bins) {
    return std::min(static_cast<std::uint32_t>((item.place[axis] - lo[axis]) * scale), bins - 1);
  }

  static Cut best_cut(Items items, Vec3d lo, Vec3d extent) {
    const auto bins = static_cast<std::uint32_t>(std::min<std::size_t>(kBins, items.size()));
    Cut best;
    for (int axis = 0; axis < 3; ++axis) {
      const double scale = bins / extent[axis];
      if (!std::isfinite(scale)) continue;
      std::array<Sum, kBins> sums{};
      for (const Item& item : items) sums[bin_of(item, axis, lo, scale, bins)].add(item.bounds);
      for (Sum& sum : sums) sum.begin_cone();
      for (const Item& item : items) sums[bin_of(item, axis, lo, scale, bins)].cone.extend(item.bounds);

      // A box that is thin where it could be cut is no gain: Conty Estevez & Kulla's factor for that.
      const double thin = max_component(extent) / extent[axis];
      std::array<double, kBins> above_cost{};
      Sum above;
      for (std::uint32_t bin = bins - 1; bin > 0; --bin) {
        above.merge(sums[bin]);
        above_cost[bin] = above.count > 0 ? above.cost() : std::numeric_limits<double>::infinity();
      }
      Sum below;
      for (std::uint32_t bin = 1; bin < bins; ++bin) {
        below.merge(sums[bin - 1]);
        if (below.count == 0) continue;
        const double cost = thin * (below.cost() + above_cost[bin]);
        if (cost < best.cost) best = {axis, bin, bins, cost};
      }
    }
    return best;
  }

  /// Those that `is_first` come first, in both halves in the order that they had: the same with every library.
  template <typename IsFirst>
  std::size_t part(Items items, IsFirst is_first) {
    second_.clear();
    std::size_t count = 0;
    for (const Item& item : items) {
      if (is_first(item))
        items[count++] = item;
      else
        second_.push_back(item);
    }
    std::ranges::copy(second_, items.begin() + static_cast<std::ptrdiff_t>(count));
    return count;
  }

  LightTree& tree_;
  std::vector<Item> items_, second_;
  double scale_ = 0;
};

LightTree::LightTree(std::span<const LightBounds> lights) { Builder(*this, lights); }

}  // namespace tessera
