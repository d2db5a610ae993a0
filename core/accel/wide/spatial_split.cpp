#include "core/accel/wide/spatial_split.h"

#include <algorithm>
#include <cmath>

#include "core/accel/wide/triangle_cut.h"

namespace tessera {
namespace {

/// Of the object split's cost, at least, by which it would fall if its children were cut clean of each other.
constexpr float kLeastGain = 0.1F;

/// Boxes that a line through the node meets on average: 3 to 7 for whole meshes of any fineness and for their parts,
/// over 100 in interiors that aren't aligned with the axes.
constexpr float kManyBoxes = 8;

LanesBox common(const LanesBox& a, const LanesBox& b) { return {max(a.lo, b.lo), min(a.hi, b.hi)}; }

class Slabs {
 public:
  explicit Slabs(const LanesBox& box) : base_(box.lo), last_(spread(kSlabs - 1)) {
    const Lanes size = box.hi - box.lo;
    for (int axis = 0; axis < 3; ++axis) {
      const float scale = kSlabs / size[axis];
      scale_[axis] = std::isfinite(scale) ? scale : 0;
      step_[axis] = scale_[axis] > 0 ? size[axis] / kSlabs : 0;
    }
    scale_[3] = step_[3] = 0;
  }
  IntLanes slabs_of(Lanes p) const {
    return __builtin_convertvector(min(max((p - base_) * scale_, Lanes{}), last_), IntLanes);
  }
  /// Between slabs `slab - 1` and `slab`.
  float plane(int axis, int slab) const { return base_[axis] + step_[axis] * static_cast<float>(slab); }

  static constexpr int kSlabs = BinGrid::kMostBins;

 private:
  Lanes base_, scale_, step_, last_;
};

/// The boxes of a triangle's parts in each slab from `first` to `last`: about, since they only tell what splits cost.
void chop(const Corners& corners, const Slabs& slabs, int axis, int first, int last, LanesBox* part) {
  for (int slab = first; slab <= last; ++slab) part[slab] = LanesBox::empty();
  for (std::size_t i = 0; i < 3; ++i) {
    Lanes a = corners[i], b = corners[(i + 1) % 3];
    part[std::clamp(slabs.slabs_of(a)[axis], first, last)].extend(a);
    if (a[axis] > b[axis]) std::swap(a, b);
    const int from = std::max(slabs.slabs_of(a)[axis], first), to = std::min(slabs.slabs_of(b)[axis], last);
    const Lanes slope = (b - a) / spread(b[axis] - a[axis]);
    for (int slab = from + 1; slab <= to; ++slab) {
      const float plane = slabs.plane(axis, slab);
      const Lanes at = min(max(a + slope * spread(plane - a[axis]), min(a, b)), max(a, b));
      part[slab - 1].extend(at);
      part[slab].extend(at);
    }
  }
}

}  // namespace

bool promises_spatial_split(std::span<const PrimitiveRef> refs, const LanesBox& box, const Split& split, float unit) {
  const int axis = split.axis;
  LanesBox left = split.left_box, right = split.right_box;
  const float middle = (left.hi[axis] + right.lo[axis]) * 0.5F;
  if (left.hi[axis] <= right.lo[axis]) return false;
  left.hi[axis] = right.lo[axis] = middle;
  const float clean =
      half_area(left, unit) * static_cast<float>(split.left) + half_area(right, unit) * static_cast<float>(split.right);
  if (clean > split.cost * (1 - kLeastGain)) return false;
  float areas = 0;
  for (const PrimitiveRef& ref : refs) areas += half_area(ref.box(), unit);
  return areas > kManyBoxes * half_area(box, unit);
}

SpatialSplit best_spatial_split(const TriangleMesh& mesh, std::span<const PrimitiveRef> refs, const LanesBox& box,
                                float unit) {
  const Slabs slabs(box);
  Bins bins(Slabs::kSlabs);
  LanesBox part[Slabs::kSlabs];
  for (const PrimitiveRef& ref : refs) {
    const IntLanes from = slabs.slabs_of(ref.lo), to = slabs.slabs_of(ref.hi);
    for (int axis = 0; axis < 3; ++axis) {
      const int first = from[axis], last = to[axis];
      ++bins.entering[first][axis];
      ++bins.leaving[last][axis];
      if (first == last) {
        bins.box[axis][first].extend(ref.box());
        continue;
      }
      chop(corners_of(mesh, ref.triangle()), slabs, axis, first, last, part);
      for (int slab = first; slab <= last; ++slab) {
        const LanesBox piece = common(part[slab], ref.box());
        if (!piece.is_empty()) bins.box[axis][slab].extend(piece);
      }
    }
  }
  SpatialSplit best{bins.best_split(static_cast<std::uint32_t>(refs.size()), unit)};
  if (best.split.axis >= 0) best.plane = slabs.plane(best.split.axis, best.split.bin);
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

Side Reunion::side_of(const PrimitiveRef& ref) {
  LanesBox left_with = left_, right_with = right_;
  left_with.extend(ref.box());
  right_with.extend(ref.box());
  const float left = half_area(left_, unit_), right = half_area(right_, unit_);
  const float cost_both = left * lefts_ + right * rights_;
  const float cost_left = half_area(left_with, unit_) * lefts_ + right * (rights_ - 1);
  const float cost_right = left * (lefts_ - 1) + half_area(right_with, unit_) * rights_;
  if (cost_both <= cost_left && cost_both <= cost_right) return Side::both;
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
