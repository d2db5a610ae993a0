#include "tests/benchmarks/support/hit_errors.h"

#include <algorithm>

namespace tessera::bench {
namespace {

/// Of the reach; double's 2^-53 and a few operations' worth.
constexpr Wide kBoundary = 0x1p-46L;

}  // namespace

std::vector<TrueAnswer> true_answers(const Scene& scene, const std::vector<Ray>& rays) {
  Aabb box;
  for (const Aabb& object : world_bounds(scene)) box.extend(object);
  std::vector<TrueAnswer> out;
  for (const Ray& ray : rays) {
    TrueAnswer truth{wide_trace(scene, ray), reach(box, ray), false};
    truth.is_boundary = truth.answer.margin < truth.reach * kBoundary;
    out.push_back(std::move(truth));
  }
  return out;
}

HitErrors hit_errors(const Accel& accel, const std::vector<Ray>& rays, const std::vector<TrueAnswer>& truth) {
  HitErrors errors;
  std::uint64_t measured = 0;
  double sum_ulp = 0, sum_reach = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ++errors.rays;
    const auto found = accel.closest(rays[i]);
    const auto& hits = truth[i].answer.hits;
    const auto wrong = [&](std::uint64_t& count) { ++(truth[i].is_boundary ? errors.boundary : count); };
    if (!found || hits.empty()) {
      if (found) wrong(errors.invented);
      if (!hits.empty()) wrong(errors.missed);
      continue;
    }
    const auto mine = std::ranges::find_if(
        hits, [&](const WideHit& h) { return h.object == found->object && h.primitive == found->primitive; });
    // Within two roundings of the nearest, either of two may come out first.
    if (mine == hits.end() || mine->t - hits.front().t > 2 * ulp(hits.front().t)) {
      wrong(errors.wrong_primitive);
      continue;
    }
    const Wide off = std::abs(found->t - mine->t);
    const auto in_ulp = static_cast<double>(off / ulp(mine->t));
    const auto in_reach = static_cast<double>(off * max_component(abs(widen(rays[i].direction))) /
                                              (truth[i].reach * static_cast<Wide>(kUnitRoundoff)));
    errors.max_ulp = std::max(errors.max_ulp, in_ulp);
    errors.max_reach = std::max(errors.max_reach, in_reach);
    sum_ulp += in_ulp;
    sum_reach += in_reach;
    ++measured;
  }
  if (measured > 0) {
    errors.mean_ulp = sum_ulp / static_cast<double>(measured);
    errors.mean_reach = sum_reach / static_cast<double>(measured);
  }
  return errors;
}

}  // namespace tessera::bench
