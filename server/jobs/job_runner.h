#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "core/scene/scene.h"
#include "server/jobs/job_table.h"
#include "server/store/structure_cache.h"
#include "server/work/scheduler.h"

namespace tessera::server {

/// Takes jobs through their states on the scheduler's threads: plan, structure, passes of tiles. Whatever goes wrong on
/// the way fails the job and nothing else. Safe to call from any number of threads.
class JobRunner {
 public:
  /// Tells how long a job has been rendering; called by any thread.
  using Clock = std::function<std::chrono::steady_clock::time_point()>;

  JobRunner(Scheduler& scheduler, StructureCache& structures, JobTable& jobs,
            Clock clock = std::chrono::steady_clock::now)
      : scheduler_(scheduler), structures_(structures), jobs_(jobs), clock_(std::move(clock)) {}

  /// Starts a job that the table has admitted, for this scene seen through this camera. If that fails, so does the job.
  void start(const JobTable::Admitted& job, const JobOrder& order, std::shared_ptr<const Scene> scene,
             const Camera& camera);

  unsigned threads() const { return scheduler_.threads(); }

 private:
  struct OpenTile;
  class PausedTiles;
  struct Run;

  void prepare(const std::shared_ptr<Run>& run);
  void find_structure(const std::shared_ptr<Run>& run);
  void render(const std::shared_ptr<Run>& run);
  void begin_pass(const std::shared_ptr<Run>& run);
  void end_pass(const std::shared_ptr<Run>& run);
  /// Renders on at a tile for a turn; whether it is done.
  bool render_tile(const std::shared_ptr<Run>& run, std::size_t index);
  /// Runs a step of a job; an exception fails the job.
  template <typename Step>
  void guard(const std::string& job, Step step) noexcept;

  Scheduler& scheduler_;
  StructureCache& structures_;
  JobTable& jobs_;
  const Clock clock_;
};

}  // namespace tessera::server
