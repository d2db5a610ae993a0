#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/accel/accel.h"
#include "tests/benchmarks/support/recorded_rays.h"

namespace tessera::bench {

/// Rays of one kind, few enough to trace with any structure: short runs of neighbours, from all over the job and in
/// random order, so that the first of them speak for the rest.
struct RaySample {
  std::string name;
  bool is_any_hit = false;   ///< Traced with `occluded`.
  double rays_in_a_job = 0;  ///< Those that the sample stands for.
  std::vector<Ray> rays;
};

/// One sample for each kind of recorded rays that isn't empty.
std::vector<RaySample> sample_rays(const RecordedRays& recorded, std::size_t at_most);

/// Segments between points evenly distributed in the scene's box; part of no job.
RaySample random_segments(const Scene& scene, std::size_t count, std::uint64_t seed);

/// Mean processor time of a ray. The sample is traced again until 20 ms have passed, and not to its end when that
/// takes longer than `at_most` seconds. Precondition: the sample isn't empty.
double seconds_per_ray(const Accel& accel, const RaySample& sample, double at_most);

/// What a ray costs in tests, on average.
struct MeanTests {
  double volume_tests = 0, volume_hits = 0, object_tests = 0, object_hits = 0, false_hits = 0;
  static constexpr std::array kAll = {&MeanTests::volume_tests, &MeanTests::volume_hits, &MeanTests::object_tests,
                                      &MeanTests::object_hits, &MeanTests::false_hits};
  /// The share of the volumes hit that were leaves or groups in which nothing was hit.
  double false_hit_rate() const { return volume_hits > 0 ? false_hits / volume_hits : 0; }
};
MeanTests tests_per_ray(const Accel& accel, const RaySample& sample, double at_most);

}  // namespace tessera::bench
