#include "tests/benchmarks/support/structure_bench.h"

#include <nlohmann/json.hpp>

namespace tessera::bench {
namespace {

constexpr double kSlowBuildMs = 1000;
/// Of one repetition and one kind of ray; a structure that needs longer traces fewer rays.
constexpr double kTraceSeconds = 0.08, kCountSeconds = 0.05;

nlohmann::json to_json(const MeanTests& tests) {
  return {{"volume_tests", tests.volume_tests}, {"volume_hits", tests.volume_hits},
          {"object_tests", tests.object_tests}, {"object_hits", tests.object_hits},
          {"false_hits", tests.false_hits},     {"false_hit_rate", tests.false_hit_rate()}};
}

/// Has the meshes built that are left until a ray comes to them: one begins in the middle of each object's box.
void build_all(const Scene& scene, const Accel& accel) {
  for (const Aabb& box : world_bounds(scene))
    if (!box.empty()) accel.closest(Ray{box.center(), {0, 0, 1}});
}

}  // namespace

StructureBench::StructureBench(StructureChoice choice, std::shared_ptr<const Scene> scene,
                               const std::vector<RaySample>& rays)
    : choice_(std::move(choice)), scene_(std::move(scene)), rays_(&rays), mrays_(rays.size()) {}

void StructureBench::repeat() {
  if (!accel_ || build_ms_.median() < kSlowBuildMs) {
    accel_.reset();
    const CpuStopwatch watch;
    accel_ = make_accel(scene_, choice_.options);
    if (choice_.options.kind == AccelKind::wide) build_all(*scene_, *accel_);
    build_ms_.add(1e3 * watch.seconds());
  }
  double job_ms = 0;
  for (std::size_t i = 0; i < rays_->size(); ++i) {
    const double seconds = seconds_per_ray(*accel_, (*rays_)[i], kTraceSeconds);
    mrays_[i].add(1e-6 / seconds);
    job_ms += 1e3 * seconds * (*rays_)[i].rays_in_a_job;
  }
  trace_ms_.add(job_ms);
  total_ms_.add(build_ms_.last() + job_ms);
}

void StructureBench::count() {
  tests_by_rays_.clear();
  double rays_in_a_job = 0;
  MeanTests sum;
  for (const RaySample& rays : *rays_) {
    const MeanTests& mean = tests_by_rays_.emplace_back(tests_per_ray(*accel_, rays, kCountSeconds));
    rays_in_a_job += rays.rays_in_a_job;
    for (const auto count : MeanTests::kAll) sum.*count += mean.*count * rays.rays_in_a_job;
  }
  for (const auto count : MeanTests::kAll) tests_.*count = sum.*count / rays_in_a_job;
}

const Samples* StructureBench::mrays(const std::string& rays) const {
  for (std::size_t i = 0; i < rays_->size(); ++i)
    if ((*rays_)[i].name == rays) return &mrays_[i];
  return nullptr;
}

nlohmann::json StructureBench::to_json() const {
  const AccelStats stats = accel_->stats();
  nlohmann::json json = {{"structure", choice_.label},
                         {"options", describe(choice_.options)},
                         {"build_ms", build_ms_.to_json()},
                         {"trace_ms", trace_ms_.to_json()},
                         {"total_ms", total_ms_.to_json()},
                         {"bytes", stats.bytes},
                         {"nodes", stats.nodes},
                         {"leaves", stats.leaves},
                         {"depth", stats.depth},
                         {"tests_per_ray", bench::to_json(tests_)}};
  for (std::size_t i = 0; i < rays_->size(); ++i)
    json["rays"][(*rays_)[i].name] = {{"mrays", mrays_[i].to_json()},
                                      {"tests_per_ray", bench::to_json(tests_by_rays_[i])}};
  return json;
}

}  // namespace tessera::bench
