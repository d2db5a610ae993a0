#include "core/accel/wide/spatial_split.h"

#include <algorithm>
#include <cmath>

#include "core/accel/wide/triangle_cut.h"

namespace tessera {
namespace {

/// Part of the object split's cost, at least, that would be saved if its children were cut clean of each other.
constexpr float kLeastGain = 0.1F;

/// Boxes that a line through the node meets on average: 3 to 7 in surfaces of small triangles, however many there are;
/// 20 to 160 in interiors that aren't aligned with the axes.
constexpr float kManyBoxes = 8;

/// References from which on a plane is looked for: fewer are seldom worth cutting.
constexpr std::size_t kManyReferences = 100;

LanesBox common(const LanesBox& a, const LanesBox& b) { return {max(a.lo, b.lo), min(a.hi, b.hi)}; }

/// Cuts a node's box into equal slabs along its longest axis.
class Slabs {
 public:
  explicit Slabs(const LanesBox& box) {
    const Lanes size = box.hi - box.lo;
    axis_ = size[0] > size[1] ? 0 : 1;
    if (size[2] > size[axis_]) axis_ = 2;
    base_ = box.lo[axis_];
    const float scale = kSlabs / size[axis_];
    scale_ = std::isfinite(scale) ? scale : 0;
    step_ = scale_ > 0 ? size[axis_] / kSlabs : 0;
  }
  int axis() const { return axis_; }
  std::uint32_t slab_of(Lanes p) const {
    return static_cast<std::uint32_t>(std::min(std::max(0.0F, (p[axis_] - base_) * scale_), kSlabs - 1.0F));
  }
  /// Between slabs `slab - 1` and `slab`.
  float plane(std::uint32_t slab) const { return base_ + step_ * static_cast<float>(slab); }

  static constexpr int kSlabs = BinGrid::kMostBins;

 private:
  int axis_;
  float base_, scale_, step_;
};

/// Extends the boxes of slabs from `first` to `last` by a triangle's parts in them, as far as they are in a reference's
/// box: about, since they only tell what splits cost.
void chop(const Corners& corners, const PrimitiveRef& ref, const Slabs& slabs, std::uint32_t first, std::uint32_t last,
          LanesBox* box) {
  const int axis = slabs.axis();
  const auto inside = [&ref](Lanes p) { return min(max(p, ref.lo), ref.hi); };
  for (std::size_t i = 0; i < 3; ++i) {
    Lanes a = corners[i], b = corners[(i + 1) % 3];
    std::uint32_t from = slabs.slab_of(a), to = slabs.slab_of(b);
    box[std::clamp(from, first, last)].extend(inside(a));
    if (from > to) {
      std::swap(from, to);
      std::swap(a, b);
    }
    if (from == to) continue;
    const Lanes slope = (b - a) / spread(b[axis] - a[axis]);
    for (std::uint32_t slab = std::max(from, first) + 1; slab <= std::min(to, last); ++slab) {
      const Lanes at = inside(a + slope * spread(slabs.plane(slab) - a[axis]));
      box[slab - 1].extend(at);
      box[slab].extend(at);
    }
  }
}

}  // namespace

bool promises_spatial_split(std::span<const PrimitiveRef> refs, const LanesBox& box, const Split& split, float unit) {
  if (refs.size() < kManyReferences) return false;
  const int axis = split.axis;
  LanesBox left = split.left_box, right = split.right_box;
  const float middle = (left.hi[axis] + right.lo[axis]) * 0.5F;
  if (left.hi[axis] <= right.lo[axis]) return false;
  left.hi[axis] = right.lo[axis] = middle;
  const float clean = half_area(left, unit) * static_cast<float>(batches_of(split.left)) +
                      half_area(right, unit) * static_cast<float>(batches_of(split.right));
  if (clean > split.cost * (1 - kLeastGain)) return false;
  float areas = 0;
  for (const PrimitiveRef& ref : refs) areas += half_area(ref.box(), unit);
  return areas > kManyBoxes * half_area(box, unit);
}

SpatialSplit best_spatial_split(const TriangleMesh& mesh, std::span<const PrimitiveRef> refs, const LanesBox& box,
                                float unit) {
  const Slabs slabs(box);
  const int axis = slabs.axis();
  Bins bins(Slabs::kSlabs);
  // Along the other axes all stay in one bin, which nothing parts.
  const auto count = static_cast<std::int32_t>(refs.size());
  bins.entering[0] = bins.leaving[0] = IntLanes{count, count, count, 0};
  bins.entering[0][axis] = bins.leaving[0][axis] = 0;
  LanesBox* slab = bins.box[axis];
  for (const PrimitiveRef& ref : refs) {
    const std::uint32_t first = slabs.slab_of(ref.lo), last = slabs.slab_of(ref.hi);
    ++bins.entering[first][axis];
    ++bins.leaving[last][axis];
    if (first == last) {
      slab[first].extend(ref.box());
    } else if (last - first == 1) {
      LanesBox low = ref.box(), high = low;
      low.hi[axis] = high.lo[axis] = slabs.plane(last);
      slab[first].extend(low);
      slab[last].extend(high);
    } else {
      chop(corners_of(mesh, ref.triangle()), ref, slabs, first, last, slab);
    }
  }
  SpatialSplit best{bins.best_split(static_cast<std::uint32_t>(refs.size()), unit)};
  if (best.split.axis >= 0) best.plane = slabs.plane(static_cast<std::uint32_t>(best.split.bin));
  return best;
}

RefCut::RefCut(const TriangleMesh& mesh, const PrimitiveRef& ref, int axis, float plane) {
  const TriangleCut cut(corners_of(mesh, ref.triangle()), axis, plane);
  left = common(cut.below, ref.box());
  right = common(cut.above, ref.box());
}

Reunion::Reunion(const Split& split, float unit)
    : unit_(unit),
      left_(split.left_box),
      right_(split.right_box),
      lefts_(static_cast<float>(split.left)),
      rights_(static_cast<float>(split.right)) {}

Side Reunion::side_of(const PrimitiveRef& ref, bool may_cut) {
  LanesBox left_with = left_, right_with = right_;
  left_with.extend(ref.box());
  right_with.extend(ref.box());
  const float left = half_area(left_, unit_), right = half_area(right_, unit_);
  const float cost_both = left * lefts_ + right * rights_;
  const float cost_left = half_area(left_with, unit_) * lefts_ + right * (rights_ - 1);
  const float cost_right = left * (lefts_ - 1) + half_area(right_with, unit_) * rights_;
  if (may_cut && cost_both <= cost_left && cost_both <= cost_right) return Side::both;
  if (cost_left <= cost_right) {
    left_ = left_with;
    --rights_;
    return Side::left;
  }
  right_ = right_with;
  --lefts_;
  return Side::right;
}

}  // namespace tessera
