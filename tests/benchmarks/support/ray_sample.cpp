#include "tests/benchmarks/support/ray_sample.h"

#include <algorithm>
#include <numeric>

#include "tests/benchmarks/support/samples.h"
#include "tests/support/random.h"

namespace tessera::bench {
namespace {

/// Neighbours in a run; between runs the clock is read.
constexpr std::size_t kRun = 32;

std::vector<Ray> scattered_runs(std::span<const Ray> rays, std::size_t at_most) {
  std::vector<std::size_t> runs((rays.size() + kRun - 1) / kRun);
  std::iota(runs.begin(), runs.end(), std::size_t{0});
  Random random(rays.size());
  for (std::size_t i = runs.size(); i > 1; --i) std::swap(runs[i - 1], runs[random.bits() % i]);
  std::vector<Ray> out;
  for (const std::size_t run : runs) {
    if (out.size() >= at_most) break;
    const auto some = rays.subspan(run * kRun, std::min(kRun, rays.size() - run * kRun));
    out.insert(out.end(), some.begin(), some.end());
  }
  return out;
}

/// Traces runs, from the start again after the last, until `enough(rays traced, seconds)`. Returns how many.
template <typename Enough>
std::uint64_t trace_runs(const Accel& accel, const RaySample& sample, TraceLog log, Enough&& enough) {
  std::uint64_t traced = 0, hits = 0;
  const Stopwatch watch;
  for (std::size_t at = 0; !enough(traced, watch.seconds()); at = at + kRun < sample.rays.size() ? at + kRun : 0) {
    const auto run = std::span(sample.rays).subspan(at, std::min(kRun, sample.rays.size() - at));
    for (const Ray& ray : run)
      hits += sample.is_any_hit ? (accel.occluded(ray, log) ? 1 : 0) : (accel.closest(ray, log) ? 1 : 0);
    traced += run.size();
  }
  // The hits are used, so that no compiler drops the work.
  return hits > traced ? 0 : traced;
}

}  // namespace

std::vector<RaySample> sample_rays(const RecordedRays& recorded, std::size_t at_most) {
  std::vector<RaySample> samples;
  for (const RayKind kind : kRayKinds)
    if (const auto rays = recorded.of(kind); !rays.empty())
      samples.push_back({std::string(name(kind)), kind == RayKind::shadow, static_cast<double>(rays.size()),
                         scattered_runs(rays, at_most)});
  return samples;
}

RaySample random_segments(const Scene& scene, std::size_t count, std::uint64_t seed) {
  Aabb box;
  for (const Aabb& object : world_bounds(scene)) box.extend(object);
  const Vec3d middle = to_double(box.center()), half = to_double(box.diagonal()) * 0.5;
  Random random(seed);
  const auto point = [&] {
    const Vec3d at = random.in_cube();
    return to_float(middle + Vec3d{half.x * at.x, half.y * at.y, half.z * at.z});
  };
  RaySample sample{"random", false, 0, {}};
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 from = point(), to = point();
    sample.rays.push_back({from, to - from, 0, 1});
  }
  return sample;
}

double seconds_per_ray(const Accel& accel, const RaySample& sample, double at_most) {
  const CpuStopwatch watch;
  const auto traced = trace_runs(accel, sample, {}, [&](std::uint64_t rays, double seconds) {
    return seconds > at_most || (seconds > 0.02 && rays >= sample.rays.size());
  });
  return watch.seconds() / static_cast<double>(traced);
}

MeanTests tests_per_ray(const Accel& accel, const RaySample& sample, double at_most) {
  TestCounts counts;
  const auto traced = trace_runs(accel, sample, {nullptr, &counts}, [&](std::uint64_t rays, double seconds) {
    return seconds > at_most || rays >= sample.rays.size();
  });
  const auto mean = [&](std::uint64_t count) { return static_cast<double>(count) / static_cast<double>(traced); };
  return {mean(counts.volume_tests), mean(counts.volume_hits), mean(counts.object_tests), mean(counts.object_hits),
          mean(counts.false_hits)};
}

}  // namespace tessera::bench
