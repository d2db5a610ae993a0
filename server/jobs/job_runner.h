#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/scene.h"
#include "server/jobs/job_table.h"
#include "server/store/image_store.h"
#include "server/store/structure_cache.h"
#include "server/work/scheduler.h"

namespace tessera::server {

/// Where the work on jobs that are written down is kept.
struct JobFiles {
  ImageStore& images;
  std::filesystem::path tiles;  ///< A folder for each job's.
  Scheduler& writers;           ///< Threads that may wait for the disk.
};

/// Takes jobs through their states on the scheduler's threads: plan, structure, passes of tiles. Whatever goes wrong on
/// the way fails the job and nothing else. Safe to call from any number of threads.
class JobRunner {
 public:
  /// Tells how long a job has been rendering; called by any thread.
  using Clock = std::function<std::chrono::steady_clock::time_point()>;

  /// Without `files`, nothing is kept.
  JobRunner(Scheduler& scheduler, StructureCache& structures, JobTable& jobs,
            Clock clock = std::chrono::steady_clock::now, std::optional<JobFiles> files = std::nullopt)
      : scheduler_(scheduler),
        structures_(structures),
        jobs_(jobs),
        clock_(std::move(clock)),
        files_(std::move(files)) {}

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
  /// Puts a job where an earlier daemon has left it; the tiles of its pass that are done.
  std::vector<bool> go_on(Run& run);
  void begin_pass(const std::shared_ptr<Run>& run, const std::vector<bool>& is_done = {});
  /// Has the tiles of a pass be kept, if that is worth it.
  void log_pass(Run& run);
  void end_pass(const std::shared_ptr<Run>& run);
  /// Completes a job once its image is on disk.
  void keep_image(const std::shared_ptr<Run>& run);
  bool is_worth_logging(const Run& run) const;
  /// Renders on at a tile for a turn; whether that is done, or left to others in parts.
  bool render_tile(const std::shared_ptr<Run>& run, std::size_t index, const Scheduler::Turn& turn);
  bool render_part(const std::shared_ptr<Run>& run, OpenTile& open, const Scheduler::Turn& turn);
  /// Leaves a part of a tile to a thread that has nothing to do.
  void share(const std::shared_ptr<Run>& run, OpenTile& open);
  void store(const std::shared_ptr<Run>& run, const OpenTile& done);
  /// Runs a step of a job; an exception fails the job.
  template <typename Step>
  void guard(const std::string& job, Step step) noexcept;

  Scheduler& scheduler_;
  StructureCache& structures_;
  JobTable& jobs_;
  const Clock clock_;
  const std::optional<JobFiles> files_;
};

}  // namespace tessera::server
