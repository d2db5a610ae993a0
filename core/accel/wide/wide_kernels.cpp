#include "core/accel/wide/wide_kernels.h"

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

// The instruction sets worth telling apart: the baseline, AVX2 with FMA, AVX-512; of arm64 NEON, since vectors of SVE
// have no size that a compiler knows, and can't be members.
#define HWY_DISABLED_TARGETS (HWY_SSE4 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/accel/wide/wide_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/accel/wide/fan-inl.h"
#include "core/accel/wide/fan_rays-inl.h"
#include "core/accel/wide/ray_stream-inl.h"
#include "core/accel/wide/single_ray-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {
namespace {

/// Runs `trace` with a tally that counts, or with one that costs nothing.
template <typename Trace>
HWY_INLINE void counted(TestCounts* counts, Trace&& trace) {
  if (counts)
    trace(Tally(*counts));
  else
    trace(NoTally());
}

/// Lowers `best` to `hit`, if that is one and less, and says so. Without branches: which hits are nearer than the last
/// can't be guessed.
HWY_INLINE bool lower(Hit& best, bool is_hit, const Hit& hit) {
  const auto number = [](const Hit& of) { return std::uint64_t{of.object} << 32 | of.primitive; };
  const std::uint64_t now = number(hit), before = number(best);
  const bool is_less = is_hit & ((hit.t < best.t) | ((hit.t == best.t) & (now < before)));
  const std::uint64_t kept = is_less ? now : before;
  best.t = is_less ? hit.t : best.t;
  best.object = static_cast<std::uint32_t>(kept >> 32);
  best.primitive = static_cast<std::uint32_t>(kept);
  return is_less;
}

void closest(const WideTree& tree, std::uint32_t object, std::span<const Ray> rays, std::span<Hit> hits,
             TestCounts* counts) {
  if (tree.nodes.empty()) return;
  counted(counts, [&](auto tally) HWY_ATTR {
    if (rays.size() == 1) {
      const TreeFrame frame(tree);
      SingleRay(tree, frame, object, rays[0])
          .visit(std::min(hits[0].t, rays[0].t_max), tally, [&](float t, std::uint32_t triangle) HWY_ATTR {
            hits[0] = std::min(hits[0], Hit{t, object, triangle});
            return hits[0].t;
          });
      return;
    }
    std::vector<float> limits(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) limits[i] = std::min(hits[i].t, rays[i].t_max);
    stream_rays(tree, object, rays, limits, tally,
                [&](std::size_t ray, bool is_hit, float t, std::uint32_t triangle, float limit) HWY_ATTR {
                  return lower(hits[ray], is_hit, {t, object, triangle}) ? t : limit;
                });
  });
}

void closest_from(const WideTree& tree, PrimitiveId least, const Ray& ray, Hit& hit, TestCounts* counts) {
  if (tree.nodes.empty()) return;
  counted(counts, [&](auto tally) HWY_ATTR {
    const TreeFrame frame(tree);
    SingleRay(tree, frame, least.object, ray)
        .visit(std::min(hit.t, ray.t_max), tally, [&](float t, std::uint32_t triangle) HWY_ATTR {
          if (triangle >= least.primitive) hit = std::min(hit, Hit{t, least.object, triangle});
          return hit.t;
        });
  });
}

void occluded(const WideTree& tree, std::uint32_t object, std::span<const Ray> rays, std::span<std::uint8_t> hidden,
              TestCounts* counts) {
  if (tree.nodes.empty()) return;
  counted(counts, [&](auto tally) HWY_ATTR {
    if (rays.size() == 1) {
      const TreeFrame frame(tree);
      if (!hidden[0])
        SingleRay(tree, frame, object, rays[0]).visit(rays[0].t_max, tally, [&](float, std::uint32_t) HWY_ATTR {
          hidden[0] = 1;
          return kStop;
        });
      return;
    }
    std::vector<float> limits(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) limits[i] = hidden[i] ? kStop : rays[i].t_max;
    stream_rays(tree, object, rays, limits, tally,
                [&](std::size_t ray, bool is_hit, float, std::uint32_t, float limit) HWY_ATTR {
                  hidden[ray] |= is_hit;
                  return is_hit ? kStop : limit;
                });
  });
}

void visit_bodies(const WideTree& tree, Transform::Error placed, const Ray& ray, BodyVisit visit, TestCounts* counts) {
  if (tree.nodes.empty()) return;
  counted(counts, [&](auto tally) HWY_ATTR {
    const TreeFrame frame(tree);
    SingleRay(tree, frame, placed, ray).visit_leaves(ray.t_max, tally, [&](std::uint32_t leaf, float limit) HWY_ATTR {
      return visit.call(visit.self, WideChild::at(leaf), limit);
    });
  });
}

void visit_bodies_together(const WideTree& tree, Transform::Error placed, std::span<const Ray> rays,
                           std::span<float> limits, BodyVisits visits, TestCounts* counts) {
  if (tree.nodes.empty()) return;
  counted(counts, [&](auto tally) HWY_ATTR {
    const auto visit = [&](std::uint32_t body, std::span<const std::uint32_t> some) {
      visits.call(visits.self, body, some);
    };
    RayStream<decltype(tally), decltype(visit), true>(body_stream_memory(), tree, kNoPrimitive.object, rays, limits,
                                                      tally, visit, placed)
        .run();
  });
}

/// A fan whose rays don't make whole blocks, filled up: with the last of them, which isn't looked for again.
struct FilledFan {
  FilledFan(const RayFan& fan, std::span<const Hit> known) : count(whole_blocks(fan.size())) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t from = std::min(i, fan.size() - 1);
      x[i] = fan.x[from];
      y[i] = fan.y[from];
      z[i] = fan.z[from];
      hits[i] = i < fan.size() ? known[i] : Hit{0};
    }
  }

  RayFan from(Vec3 origin) const { return RayFan(origin, x, y, z).part(0, count); }

  std::size_t count;
  float x[kFanRays], y[kFanRays], z[kFanRays];
  std::array<Hit, kFanRays> hits;
};

bool closest_fan(const WideTree& tree, std::uint32_t object, const RayFan& rays, std::span<Hit> hits,
                 TestCounts* counts) {
  if (tree.nodes.empty() || rays.size() == 0) return true;
  if (rays.size() % kBlockRays != 0) {
    FilledFan filled(rays, hits);
    const bool done = closest_fan(tree, object, filled.from(rays.origin), filled.hits, counts);
    std::copy_n(filled.hits.begin(), hits.size(), hits.begin());
    return done;
  }
  FanRays fan(rays.x.data(), rays.y.data(), rays.z.data(), rays.size());
  const std::optional<Picture> picture = take_picture(TreeFrame(tree), rays.origin, 1, fan);
  if (!picture) return false;
  ClosestFan closest(tree, *picture, rays.origin, object, hits.data(), fan);
  counted(counts, [&](auto tally) HWY_ATTR { Fan(tree, *picture, fan, closest, tally).run(); });
  closest.finish();
  return true;
}

bool occluded_fan(const WideTree& tree, std::uint32_t object, Vec3 apex, std::span<const Ray> rays,
                  std::span<std::uint8_t> hidden, TestCounts* counts) {
  if (tree.nodes.empty() || rays.empty()) return true;
  const RaysToPoint ends(apex, object, rays);
  FanRays fan(ends.direction[0], ends.direction[1], ends.direction[2], ends.count, ends.left);
  const std::optional<Picture> picture = take_picture(TreeFrame(tree), apex, -1, fan);
  if (!picture || !(ends.off <= 2 * kUnitRoundoff * picture->reach)) return false;
  OccludedFan occluded(tree, *picture, ends, rays, hidden, fan);
  counted(counts, [&](auto tally) HWY_ATTR { Fan(tree, *picture, fan, occluded, tally).run(); });
  return true;
}

}  // namespace

const WideKernels* kernels() {
  static const WideKernels all{hwy::TargetName(HWY_TARGET), closest,     closest_from, occluded, visit_bodies,
                               visit_bodies_together,       closest_fan, occluded_fan};
  return &all;
}

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera {

HWY_EXPORT(kernels);

const WideKernels& wide_kernels() {
  static const WideKernels& best = *HWY_DYNAMIC_DISPATCH(kernels)();
  return best;
}

std::vector<const WideKernels*> runnable_wide_kernels() {
  std::vector<const WideKernels*> all;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {  // their order is Highway's: the best first
    hwy::SetSupportedTargetsForTest(target);
    all.push_back(HWY_DYNAMIC_DISPATCH(kernels)());
  }
  hwy::SetSupportedTargetsForTest(0);
  return all;
}

}  // namespace tessera
#endif
