#pragma once

#include <memory>
#include <vector>

#include "tests/benchmarks/support/bench_scenes.h"
#include "tests/benchmarks/support/ray_sample.h"
#include "tests/benchmarks/support/samples.h"
#include "tests/benchmarks/support/structure_choices.h"

namespace tessera::bench {

/// One structure over one scene, measured again and again, in processor time.
class StructureBench {
 public:
  /// `rays` outlive the bench.
  StructureBench(StructureChoice choice, std::shared_ptr<const Scene> scene, const std::vector<RaySample>& rays);

  /// Builds and traces once. A build that took longer than a second isn't repeated.
  void repeat();

  /// Counts tests; once, after a `repeat`.
  void count();

  const StructureChoice& choice() const { return choice_; }
  const Samples& build_ms() const { return build_ms_; }
  const Samples& trace_ms() const { return trace_ms_; }  ///< All rays of a job.
  const Samples& total_ms() const { return total_ms_; }  ///< Build and trace.
  /// Million rays a second; null when there are no such rays.
  const Samples* mrays(const std::string& rays) const;
  AccelStats stats() const { return accel_->stats(); }
  /// Over a job's rays.
  const MeanTests& tests() const { return tests_; }

  nlohmann::json to_json() const;

 private:
  StructureChoice choice_;
  std::shared_ptr<const Scene> scene_;
  const std::vector<RaySample>* rays_;
  std::unique_ptr<const Accel> accel_;
  std::vector<Samples> mrays_;  ///< As `rays_`.
  Samples build_ms_, trace_ms_, total_ms_;
  MeanTests tests_;
  std::vector<MeanTests> tests_by_rays_;
};

}  // namespace tessera::bench
