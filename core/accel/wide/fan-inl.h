// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_FAN_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_FAN_INL
#undef TESSERA_FAN_INL
#else
#define TESSERA_FAN_INL
#endif

#include "core/accel/tally.h"
#include "core/accel/wide/dense_rays-inl.h"
#include "core/accel/wide/seen_triangles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

/// A fan's way through a tree. `Rays` (`ClosestFan`, `OccludedFan`) takes what is sure, tests what isn't, and raises
/// what the fan looks for.
template <typename Counter, typename Rays>
class Fan {
 public:
  Fan(const WideTree& tree, const Picture& picture, FanRays& fan, Rays& rays, Counter tally)
      : tree_(tree), picture_(picture), fan_(fan), rays_(rays), tally_(tally) {}

  HWY_INLINE void run() {
    stack_[top_++] = {0, fan_.all(), {-kInfinity, kInfinity, -kInfinity, kInfinity, FanRays::kNearest}};
    while (top_ > 0) {
      Pending next = stack_[--top_];
      fan_.update_blocks();
      next.blocks &= blocks_behind(next.area.nearness);
      if (next.blocks == 0) continue;
      if (WideChild::is_leaf(next.child))
        visit_leaf(next);
      else
        visit_node(tree_.nodes[next.child], next.blocks);
    }
    rays_.flush(tally_);
  }

 private:
  struct Area {
    float u_lo, u_hi, v_lo, v_hi;
    float nearness;  ///< The most, 1/depth.
  };
  struct Pending {
    std::uint32_t child;
    Blocks blocks;  ///< That the area may cover.
    Area area;
  };

  /// Blocks that a triangle's box covers up to which each is better asked ray by ray: measured on an interior, where
  /// four of five blocks in the boxes of large triangles are outside an edge, and on meshes of small ones.
  static constexpr int kFewBlocks = 8;

  /// Blocks with rays that are looked for beyond this.
  HWY_INLINE Blocks blocks_behind(float nearness) const {
    const F16 f;
    Blocks bits = 0;
    for (std::size_t k = 0; k < fan_.blocks(); k += kLanes16)
      bits |= Blocks{bits_of(f, hn::Le(hn::Load(f, fan_.block_least + k), hn::Set(f, nearness)))} << k;
    return bits;
  }

  /// Blocks that an area may cover.
  HWY_INLINE Blocks blocks_in(const Area& area, Blocks among) const {
    const F16 f;
    Blocks bits = 0;
    for (std::size_t k = 0; k < kBlocks; k += kLanes16) {
      const auto across = hn::And(hn::Le(hn::Load(f, fan_.u_lo + k), hn::Set(f, area.u_hi)),
                                  hn::Ge(hn::Load(f, fan_.u_hi + k), hn::Set(f, area.u_lo)));
      const auto down = hn::And(hn::Le(hn::Load(f, fan_.v_lo + k), hn::Set(f, area.v_hi)),
                                hn::Ge(hn::Load(f, fan_.v_hi + k), hn::Set(f, area.v_lo)));
      const auto before = hn::Le(hn::Load(f, fan_.block_least + k), hn::Set(f, area.nearness));
      bits |= Blocks{bits_of(f, hn::And(hn::And(across, down), before))} << k;
    }
    return bits & among;
  }

  /// Blocks of which some corner, and so perhaps a ray, is not outside any of a triangle's edges. Rounding never takes
  /// a ray's edge function beyond its block's, since each operation grows with what it is given.
  HWY_INLINE Blocks blocks_inside(const SeenTriangles& seen, std::size_t i, Blocks among) const {
    const F16 f;
    Blocks bits = 0;
    for (std::size_t k = 0; k < kBlocks; k += kLanes16) {
      const auto most = [&](std::size_t e) HWY_ATTR {
        const float du = seen.du[e][i], dv = seen.dv[e][i];
        const auto u = hn::Load(f, (du < 0 ? fan_.u_lo : fan_.u_hi) + k);
        const auto v = hn::Load(f, (dv < 0 ? fan_.v_lo : fan_.v_hi) + k);
        return hn::MulAdd(u, hn::Set(f, du), hn::MulAdd(v, hn::Set(f, dv), hn::Set(f, seen.at[e][i])));
      };
      const auto outside = hn::Lt(hn::Min(most(0), hn::Min(most(1), most(2))), hn::Zero(f));
      bits |= Blocks{bits_of(f, hn::Not(outside))} << k;
    }
    return bits & among;
  }

  /// Blocks all of whose rays lie in an area.
  HWY_INLINE Blocks blocks_within(const Area& area, Blocks among) const {
    const F16 f;
    Blocks bits = 0;
    for (std::size_t k = 0; k < kBlocks; k += kLanes16) {
      const auto across = hn::And(hn::Ge(hn::Load(f, fan_.u_lo + k), hn::Set(f, area.u_lo)),
                                  hn::Le(hn::Load(f, fan_.u_hi + k), hn::Set(f, area.u_hi)));
      const auto down = hn::And(hn::Ge(hn::Load(f, fan_.v_lo + k), hn::Set(f, area.v_lo)),
                                hn::Le(hn::Load(f, fan_.v_hi + k), hn::Set(f, area.v_hi)));
      bits |= Blocks{bits_of(f, hn::And(across, down))} << k;
    }
    return bits & among;
  }

  /// A block's rays in an area: bits.
  HWY_INLINE std::uint32_t rays_in(std::size_t block, const Area& area) const {
    const F16 f;
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < kBlockRays; k += kLanes16) {
      const std::size_t i = block * kBlockRays + k;
      const auto u = hn::Load(f, fan_.u + i), v = hn::Load(f, fan_.v + i);
      const auto across = hn::And(hn::Le(u, hn::Set(f, area.u_hi)), hn::Ge(u, hn::Set(f, area.u_lo)));
      const auto down = hn::And(hn::Le(v, hn::Set(f, area.v_hi)), hn::Ge(v, hn::Set(f, area.v_lo)));
      const auto before = hn::Le(hn::Load(f, fan_.least + i), hn::Set(f, area.nearness));
      bits |= bits_of(f, hn::And(hn::And(across, down), before)) << k;
    }
    return bits;
  }

  /// Areas of a node's children, eight at a time.
  HWY_INLINE void visit_node(const WideNode& node, Blocks blocks) {
    const F8 f;
    alignas(32) float u_lo[8], u_hi[8], v_lo[8], v_hi[8], nearness[8];
    std::uint32_t in_sight = 0;
    const bool down = picture_.sign < 0;
    for (std::size_t first = 0; first < 8; first += kLanes8) {
      const auto plane = [&](bool high, std::uint32_t axis, int i) HWY_ATTR {
        const hn::Rebind<std::uint8_t, F8> bytes;
        const hn::Rebind<std::int32_t, F8> whole;
        const auto lattice = hn::LoadU(bytes, (high ? node.hi[axis] : node.lo[axis]) + first);
        return hn::MulAdd(hn::ConvertTo(f, hn::PromoteTo(whole, lattice)), hn::Set(f, node.step[axis]),
                          hn::Set(f, node.origin[axis] - picture_.apex[i]));
      };
      const auto sign = hn::Set(f, picture_.sign), stray = hn::Set(f, picture_.stray);
      const auto near = hn::Sub(hn::Mul(sign, plane(down, picture_.axes.z, 2)), stray);
      const auto far = hn::Add(hn::Mul(sign, plane(!down, picture_.axes.z, 2)), stray);
      const AreaOf area(near, far);
      // The picture's coordinates run with the axes divided by depth, so against them where depth does.
      const auto u0 = hn::Mul(sign, hn::Sub(plane(down, picture_.axes.x, 0), hn::Mul(sign, stray)));
      const auto u1 = hn::Mul(sign, hn::Add(plane(!down, picture_.axes.x, 0), hn::Mul(sign, stray)));
      const auto v0 = hn::Mul(sign, hn::Sub(plane(down, picture_.axes.y, 1), hn::Mul(sign, stray)));
      const auto v1 = hn::Mul(sign, hn::Add(plane(!down, picture_.axes.y, 1), hn::Mul(sign, stray)));
      hn::Store(area.low(u0), f, u_lo + first);
      hn::Store(area.high(u1), f, u_hi + first);
      hn::Store(area.low(v0), f, v_lo + first);
      hn::Store(area.high(v1), f, v_hi + first);
      hn::Store(hn::Min(area.over_near, hn::Set(f, FanRays::kNearest)), f, nearness + first);
      const auto children = hn::LoadU(U8(), node.child + first);
      const auto there = hn::Ne(children, hn::Set(U8(), kNoChild));
      in_sight |= bits_of(f, hn::And(hn::RebindMask(f, there), hn::Gt(far, hn::Zero(f)))) << first;
    }
    std::uint32_t order = far_to_near(node, picture_.octant);
    for (int i = 0; i < 8; ++i, order >>= 3) {
      const std::uint32_t slot = order & 7;
      if (!(in_sight >> slot & 1)) continue;
      const Area child{u_lo[slot], u_hi[slot], v_lo[slot], v_hi[slot], nearness[slot]};
      Blocks entered = blocks_in(child, blocks);
      // A block that isn't inside may cover more of the picture than its rays do. Leaves ask their rays anyway.
      if (Rays::kAsksRays && !WideChild::is_leaf(node.child[slot]))
        for (Blocks left = entered ^ blocks_within(child, entered); left != 0; left &= left - 1)
          if (!rays_in(static_cast<std::size_t>(std::countr_zero(left)), child)) entered ^= left & -left;
      tally_.volume(entered != 0);
      if (entered == 0) continue;
      stack_[top_++] = {node.child[slot], entered, child};
      prefetch(tree_, node.child[slot]);
    }
  }

  HWY_INLINE void visit_leaf(const Pending& next) {
    const Leaf leaf(tree_, next.child);
    const auto before = tally_.hits();
    std::uint32_t inside[kBlocks];
    std::size_t count = 0;
    for (Blocks left = next.blocks; left != 0; left &= left - 1) {
      const auto block = static_cast<std::size_t>(std::countr_zero(left));
      inside[block] = rays_in(block, next.area);
      count += static_cast<std::size_t>(std::popcount(inside[block]));
    }
    if (count == 0) return tally_.looked_into(before);
    SeenTriangles seen;
    for (std::size_t first = 0; first < leaf.count; first += kLanes8) see(picture_, fan_.most, leaf, first, seen);
    if (count <= DenseRays::kMost) {
      test_together(next.blocks, inside, leaf, seen);
    } else {
      for (std::size_t i = 0; i < leaf.count; ++i) test_triangle(next.blocks, inside, leaf, i, seen);
    }
    if constexpr (Counter::kCounts) {  // which asks whether this very leaf was worth it
      rays_.flush(tally_);
      tally_.looked_into(before);
    }
  }

  /// A leaf's triangles against all rays in its area, side by side. What is doubtful is tested in the end, when what is
  /// sure has turned some of it away.
  HWY_INLINE void test_together(Blocks blocks, const std::uint32_t (&in_leaf)[kBlocks], const Leaf& leaf,
                                const SeenTriangles& seen) {
    dense_.gather(fan_, blocks, in_leaf);
    std::uint64_t doubtful[WideChild::kMostInLeaf] = {};
    static_assert(DenseRays::kMost <= 64);
    bool is_any_taken = false;
    for (std::size_t first = 0; first < dense_.count; first += kLanes16)
      is_any_taken |= test_vector(first, leaf, seen, doubtful);
    if (is_any_taken) {
      const F16 f;
      const I16 whole;
      const auto place = hn::Set(whole, rays_.place(leaf, 0));
      DenseRays::each_vector(blocks, in_leaf, [&](std::size_t first, hn::Mask<F16> mask, std::size_t at) HWY_ATTR {
        const auto taken = expand(whole, hn::LoadU(whole, dense_.taken + at), hn::RebindMask(whole, mask));
        const auto is_taken = hn::RebindMask(f, hn::Ne(taken, hn::Set(whole, DenseRays::kNone)));
        rays_.take(first, hn::And(mask, is_taken), expand(f, hn::LoadU(f, dense_.least + at), mask),
                   expand(f, hn::LoadU(f, dense_.sure + at), mask), hn::Add(place, taken));
      });
    }
    for (std::size_t i = 0; i < leaf.count; ++i)
      for (std::uint64_t left = doubtful[i]; left != 0; left &= left - 1)
        rays_.test(dense_.ray[std::countr_zero(left)], leaf, i, tally_);
  }

  /// A leaf's triangles against a vector of rays; whether some surely is hit. `doubtful` has a bit for each ray.
  HWY_INLINE bool test_vector(std::size_t first, const Leaf& leaf, const SeenTriangles& seen,
                              std::uint64_t (&doubtful)[WideChild::kMostInLeaf]) {
    const F16 f;
    const I16 whole;
    const auto u = hn::LoadU(f, dense_.u + first), v = hn::LoadU(f, dense_.v + first);
    auto lowest = hn::LoadU(f, dense_.least + first), sure = hn::LoadU(f, dense_.sure + first);
    auto taken = hn::Set(whole, DenseRays::kNone);
    const auto is_ray = hn::FirstN(f, dense_.count - first);
    const bool can_take = rays_.can_take();
    bool is_any_taken = false;
    alignas(64) float most[WideChild::kMostInLeaf][kLanes16];
    std::uint32_t unsure[WideChild::kMostInLeaf];
    for (std::size_t i = 0; i < leaf.count; ++i) {
      const auto of = [&](const float(&values)[8]) HWY_ATTR { return hn::Set(f, values[i]); };
      const auto edge = [&](int e) HWY_ATTR {
        return hn::MulAdd(u, of(seen.du[e]), hn::MulAdd(v, of(seen.dv[e]), of(seen.at[e])));
      };
      const auto e0 = edge(0), e1 = edge(1), e2 = edge(2), least = hn::Min(e0, hn::Min(e1, e2));
      const auto across = hn::And(hn::Ge(u, of(seen.u_lo)), hn::Le(u, of(seen.u_hi)));
      const auto down = hn::And(hn::Ge(v, of(seen.v_lo)), hn::Le(v, of(seen.v_hi)));
      const auto near =
          hn::MulAdd(e0, of(seen.by_edge[0]),
                     hn::MulAdd(e1, of(seen.by_edge[1]), hn::MulAdd(e2, of(seen.by_edge[2]), of(seen.base))));
      const auto low = hn::MulSub(near, of(seen.share), of(seen.error)), high = hn::Add(near, of(seen.error));
      auto maybe =
          hn::And(hn::And(is_ray, hn::And(across, down)), hn::And(hn::Ge(least, hn::Zero(f)), hn::Ge(high, lowest)));
      if constexpr (Rays::kLeave) {
        const auto own = hn::Eq(hn::LoadU(U16(), dense_.left + first), hn::Set(U16(), seen.number[i]));
        maybe = hn::AndNot(hn::RebindMask(f, own), maybe);
      }
      const auto inside = hn::Set(f, can_take ? seen.inside[i] : kInfinity);
      const auto is_sure = hn::And(maybe, hn::And(hn::Ge(least, inside), hn::Gt(low, sure)));
      lowest = hn::IfThenElse(is_sure, Rays::least_after(low), lowest);
      sure = hn::IfThenElse(is_sure, high, sure);
      taken = hn::IfThenElse(hn::RebindMask(whole, is_sure), hn::Set(whole, static_cast<std::int32_t>(i)), taken);
      const std::uint32_t sure_bits = bits_of(f, is_sure);
      is_any_taken |= sure_bits != 0;
      unsure[i] = bits_of(f, maybe) & ~sure_bits;
      hn::Store(high, f, most[i]);
      count_sure(sure_bits);
    }
    for (std::size_t i = 0; i < leaf.count; ++i)
      doubtful[i] |= std::uint64_t{unsure[i] & bits_of(f, hn::Ge(hn::Load(f, most[i]), lowest))} << first;
    hn::StoreU(lowest, f, dense_.least + first);
    hn::StoreU(sure, f, dense_.sure + first);
    hn::StoreU(taken, whole, dense_.taken + first);
    return is_any_taken;
  }

  /// One of a leaf's triangles against blocks, and of them the rays in the leaf's area: elsewhere it stands in others.
  HWY_INLINE void test_triangle(Blocks blocks, const std::uint32_t (&in_leaf)[kBlocks], const Leaf& leaf, std::size_t i,
                                const SeenTriangles& seen) {
    const F16 f;
    Blocks covered = blocks_in({seen.u_lo[i], seen.u_hi[i], seen.v_lo[i], seen.v_hi[i], seen.nearness[i]}, blocks);
    if (Rays::kAsksBlocks && std::popcount(covered) > kFewBlocks) covered = blocks_inside(seen, i, covered);
    const auto of = [&](const float(&values)[8]) HWY_ATTR { return hn::Set(f, values[i]); };
    const hn::Vec<F16> du[3] = {of(seen.du[0]), of(seen.du[1]), of(seen.du[2])};
    const hn::Vec<F16> dv[3] = {of(seen.dv[0]), of(seen.dv[1]), of(seen.dv[2])};
    const hn::Vec<F16> at[3] = {of(seen.at[0]), of(seen.at[1]), of(seen.at[2])};
    const hn::Vec<F16> by_edge[3] = {of(seen.by_edge[0]), of(seen.by_edge[1]), of(seen.by_edge[2])};
    const auto base = of(seen.base);
    const auto error = of(seen.error), share = of(seen.share);
    const auto inside = rays_.can_take() ? of(seen.inside) : hn::Set(f, kInfinity);
    for (; covered != 0; covered &= covered - 1) {
      const auto block = static_cast<std::size_t>(std::countr_zero(covered));
      for (std::size_t k = 0; k < kBlockRays; k += kLanes16) {
        const std::size_t first = block * kBlockRays + k;
        const auto u = hn::Load(f, fan_.u + first), v = hn::Load(f, fan_.v + first);
        const auto edge = [&](int e) HWY_ATTR { return hn::MulAdd(u, du[e], hn::MulAdd(v, dv[e], at[e])); };
        const auto e0 = edge(0), e1 = edge(1), e2 = edge(2), least = hn::Min(e0, hn::Min(e1, e2));
        const auto near = hn::MulAdd(e0, by_edge[0], hn::MulAdd(e1, by_edge[1], hn::MulAdd(e2, by_edge[2], base)));
        const auto low = hn::MulSub(near, share, error), high = hn::Add(near, error);
        auto maybe = hn::And(mask_of(f, in_leaf[block] >> k),
                             hn::And(hn::Ge(least, hn::Zero(f)), hn::Ge(high, hn::Load(f, fan_.least + first))));
        if constexpr (Rays::kLeave) {
          const auto own = hn::Eq(hn::Load(U16(), fan_.left + first), hn::Set(U16(), seen.number[i]));
          maybe = hn::AndNot(hn::RebindMask(f, own), maybe);
        }
        if (hn::AllFalse(f, maybe)) continue;
        const auto is_sure =
            hn::And(maybe, hn::And(hn::Ge(least, inside), hn::Gt(low, hn::Load(f, fan_.sure + first))));
        if (!hn::AllFalse(f, is_sure)) rays_.take(first, is_sure, low, high, hn::Set(I16(), rays_.place(leaf, i)));
        count_sure(bits_of(f, is_sure));
        for (std::uint32_t left = bits_of(f, hn::AndNot(is_sure, maybe)); left != 0; left &= left - 1)
          rays_.test(first + static_cast<std::size_t>(std::countr_zero(left)), leaf, i, tally_);
      }
    }
  }

  /// Rays that surely hit something count as tested.
  HWY_INLINE void count_sure(std::uint32_t rays) const {
    if constexpr (Counter::kCounts)
      for (; rays != 0; rays &= rays - 1) tally_.object(true);
  }

  const WideTree& tree_;
  const Picture& picture_;
  FanRays& fan_;
  Rays& rays_;
  const Counter tally_;
  DenseRays dense_;
  int top_ = 0;
  Pending stack_[WideTree::kMostDepth * 7 + 8];
};

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
