#pragma once

#include <chrono>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/result.h"
#include "server/job.h"

namespace tessera::server {

/// All jobs, and the one place where their states change: queued → preparing → rendering → completed | failed |
/// canceled, an end being reachable from every state that isn't one. Jobs that have ended stay until they are
/// deleted, or more jobs have ended since than are kept. Safe to call from any number of threads.
///
/// Lock order of the server: JobTable, StructureCache, SceneStore and Scheduler have one mutex each; none is held
/// while another part is called, so no two are ever held at once. The log has one, too, which is held for a moment and
/// never while anything is waited for: so a line may be logged under any other.
class JobTable {
 public:
  struct Limits {
    std::uint32_t unfinished_jobs;
    std::uint32_t ended_jobs;  ///< At least 1; when one more ends, the one that ended first is forgotten.
    std::uint64_t film_bytes;  ///< Of all jobs in the table.
  };
  explicit JobTable(Limits limits) : limits_(limits) {}

  /// How a job that has been admitted is worked on.
  struct Admitted {
    std::string id;
    std::stop_token stop;  ///< Requested when the job ends before its work does.
    std::shared_ptr<Progress> progress;
  };

  /// Adds a queued job, or refuses: `too_many_jobs`, `out_of_memory_budget`, `shutting_down`.
  proto::Result<Admitted> add(JobOrder order);

  /// Steps of a job's work. False, and nothing is changed, when it has ended or been deleted meanwhile: there is
  /// nothing left to do for it.
  bool is_unfinished(const std::string& id) const;
  bool start_preparing(const std::string& id);
  bool set_plan(const std::string& id, std::shared_ptr<const PlanReport> plan,
                std::shared_ptr<const ObjectMarks> tested);
  bool start_rendering(const std::string& id, std::optional<StructureUse> structure, std::shared_ptr<const Film> film);
  /// `structure` is what it has come to be by the end.
  bool complete(const std::string& id, std::optional<StructureUse> structure = std::nullopt);
  /// Takes no memory beyond that of a copy of `why`.
  bool fail(const std::string& id, const std::string& why);

  /// Ends a job early: `not_found` or `job_already_ended` when that can't be. What it has rendered stays.
  proto::Result<JobView> cancel(const std::string& id);

  /// Forgets a job that has ended, or says why not.
  std::optional<proto::Problem> remove(const std::string& id);

  /// `not_found` for an unknown id.
  proto::Result<JobView> find(const std::string& id) const;

  /// At most `limit` jobs with an id after `after`, oldest first, in `state` if given.
  std::vector<JobView> list(std::string_view after, std::size_t limit, std::optional<proto::JobState> state) const;

  /// Cancels every job that hasn't ended, and admits no more.
  void shut_down();

 private:
  struct Job {
    JobView view;
    std::shared_ptr<Progress> progress;
    std::stop_source stop;
    std::uint64_t film_bytes;                      ///< Set aside for it.
    std::list<std::string> id_for_ended;           ///< Until it ends, which then takes no memory.
    std::list<std::string>::iterator among_ended;  ///< Once it has ended.
  };
  using Jobs = std::map<std::string, Job, std::less<>>;
  using FilmPtr = std::shared_ptr<const Film>;

  std::string new_id();
  /// The one function that changes states. Nothing happens when the job has ended.
  bool change_state(Job& job, proto::JobState to);
  /// Changes to a state that is an end, and forgets the oldest ended job if there are too many.
  bool end(Job& job, proto::JobState to, FilmPtr& dropped);
  /// Forgets a job that has ended. Its film is handed out, for the caller to free without the lock.
  FilmPtr drop(Jobs::iterator ended);
  Job* find_unfinished(const std::string& id);

  const Limits limits_;
  mutable std::mutex mutex_;      ///< Guards what follows.
  Jobs jobs_;                     ///< Ids grow, so this is the order of arrival.
  std::list<std::string> ended_;  ///< Jobs in the order in which they ended.
  std::uint64_t film_bytes_ = 0;
  std::uint32_t unfinished_ = 0;
  std::uint64_t last_time_ = 0;
  bool closed_ = false;
};

}  // namespace tessera::server
