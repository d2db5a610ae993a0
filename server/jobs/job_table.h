#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/film/film.h"
#include "proto/wire/result.h"
#include "server/jobs/job.h"

namespace tessera::server {

/// `not_found`, as one says of a job that isn't there.
proto::Problem no_such_job();

/// All jobs, and the one place where their states change: queued → preparing → rendering → completed | failed |
/// canceled, an end being reachable from every state that isn't one. Jobs that have ended stay until they are
/// deleted, or more jobs have ended since than are kept; their images also give way to those of new jobs, the one that
/// ended first before the others. Safe to call from any number of threads.
///
/// Its mutex is held while no other part is called, but for the log, and the table of files that jobs need, whose own
/// are held for a moment and never while anything is waited for (server/README.md, "Threads").
class JobTable {
 public:
  struct Limits {
    std::uint32_t unfinished_jobs;
    std::uint32_t ended_jobs;  ///< At least 1; when one more ends, the one that ended first is forgotten.
    std::uint64_t film_bytes;  ///< Of all images that there are, or will be of jobs that haven't ended.
  };
  explicit JobTable(Limits limits) : limits_(limits) {}

  /// How a job that has been admitted is worked on.
  struct Admitted {
    std::string id;
    std::stop_token stop;  ///< Requested when the job ends before its work does.
    std::shared_ptr<Progress> progress;
    /// What its passes take is counted until no copy of this is left, however the job ends meanwhile.
    std::shared_ptr<const void> passes_memory;
  };

  /// Adds a queued job, or refuses: `too_many_jobs`, `out_of_memory_budget` when those that haven't ended leave no
  /// memory for its image, `shutting_down`; `quota_exceeded` where the order's owner has `most_of_owner` jobs that
  /// haven't ended. One that isn't `kept` ends when nobody holds it any more. What it `needs` is let go when it ends.
  proto::Result<Admitted> add(JobOrder order, bool kept = true,
                              std::optional<std::uint32_t> most_of_owner = std::nullopt,
                              std::shared_ptr<const void> needs = nullptr);

  /// Holds a job for somebody who wants its image, and lets it go when it isn't wanted any more: then a job that is
  /// neither held by others nor kept is canceled.
  class Hold {
   public:
    Hold(JobTable& table, std::string id) : table_(table), id_(std::move(id)) {}
    ~Hold() { table_.let_go(id_); }
    Hold(const Hold&) = delete;

   private:
    JobTable& table_;
    std::string id_;
  };
  /// Null for an unknown id.
  std::shared_ptr<const Hold> hold(const std::string& id);
  /// From now on the job goes on whoever lets it go.
  void keep(const std::string& id);

  /// Who waits for the end of a job.
  struct Waiter {
    /// Called once, by whatever thread ends the job.
    virtual void job_has_ended() noexcept = 0;
    Waiter* next = nullptr;

   protected:
    ~Waiter() = default;
  };
  /// From now on `waiter` waits, and lives until it has been told. False, and it doesn't wait, when the job has ended
  /// or isn't there. Takes no memory.
  bool wait(const std::string& id, Waiter& waiter);
  /// `waiter` waits no longer; false when it has been told meanwhile, or is being told.
  bool stop_waiting(const std::string& id, Waiter& waiter);

  /// Why `add` would refuse a job now that has the image of these settings, or one like the average of those that
  /// haven't ended, if that is smaller.
  std::optional<proto::Problem> refusal(const Settings& settings) const;

  /// Steps of a job's work. False, and nothing is changed, when it has ended or been deleted meanwhile: there is
  /// nothing left to do for it.
  bool is_unfinished(const std::string& id) const;
  bool start_preparing(const std::string& id);
  bool set_plan(const std::string& id, std::shared_ptr<const PlanReport> plan,
                std::shared_ptr<const ObjectMarks> tested);
  bool start_rendering(const std::string& id, std::optional<StructureUse> structure, std::shared_ptr<const Film> film);
  /// `structure` is what it has come to be by the end.
  bool complete(const std::string& id, std::optional<StructureUse> structure = std::nullopt);
  /// Takes no memory.
  bool fail(const std::string& id, std::string why);

  /// Ends a job early: `not_found` or `job_already_ended` when that can't be. What it has rendered stays.
  proto::Result<JobView> cancel(const std::string& id);

  /// Forgets a job that has ended, or says why not.
  std::optional<proto::Problem> remove(const std::string& id);

  /// `not_found` for an unknown id.
  proto::Result<JobView> find(const std::string& id) const;

  /// What there is of a job's image, for as long as the caller wants it. `image_gone` when it gave way,
  /// `image_not_ready` when there is nothing of it, `not_found` for an unknown id.
  proto::Result<std::shared_ptr<const Film>> film(const std::string& id) const;

  /// Memory for a copy of an image, counted with the images as long as this lives. Waits while there is no room for it
  /// and another copy is there, so that one always can be; throws `Abandoned` once `unwanted` is requested meanwhile.
  /// Who has one waits for nobody.
  class CopyRoom {
   public:
    CopyRoom(JobTable& table, std::uint64_t bytes, const std::stop_token& unwanted);
    ~CopyRoom();
    CopyRoom(const CopyRoom&) = delete;

   private:
    JobTable& table_;
    std::uint64_t bytes_;
  };

  /// Has the image of a job that has ended give way at once: nobody will want it again.
  void let_image_go(const std::string& id);

  /// At most `limit` jobs with an id after `after`, oldest first, in `state` if given, and of `owner` if given.
  std::vector<JobView> list(std::string_view after, std::size_t limit, std::optional<proto::JobState> state,
                            const std::optional<std::string>& owner = std::nullopt) const;

  /// Whether one of the owner's jobs shows this scene.
  bool has_job_of(std::string_view owner, const proto::ContentHash& scene) const;

  /// What there is at the moment.
  struct Usage {
    Limits limits;
    std::array<std::uint32_t, 6> by_state;  ///< Jobs, indexed by `JobState`.
    std::uint32_t unfinished;
    std::uint64_t unfinished_bytes, ended_bytes;  ///< Of films of jobs that haven't ended, and of those that have;
    std::uint64_t leaving_bytes;                  ///< of those that gave way and are still read, and of copies;
    std::uint64_t passes_bytes;                   ///< and what passes take.
  };
  Usage usage();

  /// In force for what comes from now on: nothing ends, or is refused afterwards, because of smaller ones.
  void set_limits(const Limits& limits);

  /// Admits no more jobs.
  void close();

  /// Admits no more jobs, and ends all that haven't ended, for the process does: nobody canceled them.
  void shut_down();

 private:
  struct Job {
    JobView view;
    bool kept = true;
    std::shared_ptr<const void> needs;  ///< Until it ends.
    std::uint32_t holds = 0;
    Waiter* waiters = nullptr;  ///< A list through `next`.
    std::shared_ptr<Progress> progress;
    std::stop_source stop;
    std::uint64_t film_bytes;            ///< Of its image, or set aside for it.
    std::shared_ptr<const Film> film;    ///< Once it renders, until it gives way.
    std::list<std::string> spare_nodes;  ///< For `ended_` and `ended_images_`: so that ending takes no memory.
    std::list<std::string>::iterator among_ended;   ///< Once it has ended.
    std::list<std::string>::iterator among_images;  ///< As long as it has ended, and its film is there.
  };
  using Jobs = std::map<std::string, Job, std::less<>>;
  using FilmPtr = std::shared_ptr<const Film>;

  /// What is done once the lock is given back: films are freed, and those told who waited.
  struct Aftermath {
    Aftermath() = default;
    Aftermath(const Aftermath&) = delete;
    ~Aftermath();
    std::list<FilmPtr> films;
    Waiter* told = nullptr;
  };

  std::string new_id();
  std::uint32_t unfinished_of(std::string_view owner) const;
  /// The one function that changes states. Nothing happens when the job has ended.
  bool change_state(Job& job, proto::JobState to);
  /// Changes to a state that is an end, and forgets the oldest ended job if there are too many.
  bool end(Job& job, proto::JobState to, Aftermath& after);
  /// Forgets a job that has ended.
  void drop(Jobs::iterator ended, Aftermath& after);
  /// Drops the film of a job that has ended and has one.
  void drop_film(Job& job, Aftermath& after);
  /// Drops films of jobs that have ended until there is room for one of so many bytes, or none is left.
  void make_room(std::uint64_t film, Aftermath& after);
  /// Bytes of films that have been dropped and aren't gone yet, because they are being read, and of copies.
  std::uint64_t leaving();
  /// Why no job with such a film is admitted.
  std::optional<proto::Problem> refusal_of(std::uint64_t film) const;
  /// Bytes that can't give way: of films of jobs that haven't ended, and of all passes.
  std::uint64_t taken() const { return unfinished_bytes_ + *passes_bytes_; }
  Job* find_unfinished(const std::string& id);
  void let_go(const std::string& id) noexcept;

  mutable std::mutex mutex_;  ///< Guards what follows.
  Limits limits_;
  Jobs jobs_;                            ///< Ids grow, so this is the order of arrival.
  std::list<std::string> ended_;         ///< Jobs in the order in which they ended.
  std::list<std::string> ended_images_;  ///< Those among them whose films are there.
  std::uint64_t unfinished_bytes_ = 0;   ///< Of films of jobs that haven't ended,
  std::uint64_t ended_bytes_ = 0;        ///< and of films of those that have.
  std::vector<std::pair<std::weak_ptr<const Film>, std::uint64_t>> leaving_;
  const std::shared_ptr<std::atomic<std::uint64_t>> passes_bytes_ = std::make_shared<std::atomic<std::uint64_t>>(0);
  std::uint64_t copies_bytes_ = 0;
  std::condition_variable_any copy_gone_;
  std::uint32_t unfinished_ = 0;
  std::array<std::uint32_t, 6> by_state_{};  ///< Jobs, indexed by `JobState`.
  std::uint64_t last_time_ = 0;
  bool closed_ = false;
};

}  // namespace tessera::server
