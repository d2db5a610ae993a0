#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <future>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/film/film.h"
#include "proto/wire/result.h"
#include "server/jobs/event_feed.h"
#include "server/jobs/job.h"
#include "server/jobs/job_event.h"
#include "server/store/journal.h"

namespace tessera::server {

/// `not_found`, as one says of a job that isn't there.
proto::Problem no_such_job();

/// Where the image of a job that completes lies.
struct KeptImage {
  bool on_disk = false;
  std::shared_ptr<const std::string> for_journal = nullptr;  ///< Or it goes there with the job's end.
};

/// All jobs, and the one place where their states change: queued → preparing → rendering → completed | failed |
/// canceled, an end being reachable from every state that isn't one. Jobs that have ended stay until they are
/// deleted, or more jobs have ended since than are kept; their images also give way to those of new jobs, the one that
/// ended first before the others. Safe to call from any number of threads.
///
/// It is a fold over events: one function changes what a job is, for an event that has just happened and for one that
/// an earlier daemon has written into the journal alike. Jobs that are kept are written down: they are queued, have
/// ended or are gone for those who ask once that has been, so that nothing that a client was told is taken back by a
/// crash.
///
/// Its mutex is held while no other part is called, but for the log, the journal's queue, and the table of files that
/// jobs need, whose own are held for a moment and never while anything is waited for (server/README.md, "Threads").
class JobTable {
 public:
  struct Limits {
    std::uint32_t unfinished_jobs;
    std::uint32_t ended_jobs;  ///< At least 1; when one more ends, the one that ended first is forgotten.
    std::uint64_t film_bytes;  ///< Of all images that there are, or will be of jobs that haven't ended.
  };
  /// With a journal, jobs that are kept are written into it; it is closed at the end. `forget` is there where
  /// files of jobs are kept, and is called without any lock for one whose image isn't needed any more.
  explicit JobTable(Limits limits, Journal* journal = nullptr,
                    std::function<void(const std::string& id)> forget = nullptr)
      : journal_(journal), forget_(std::move(forget)), limits_(limits) {}
  ~JobTable();
  JobTable(const JobTable&) = delete;

  using Outcome = std::optional<proto::Problem>;
  using Told = std::shared_future<Outcome>;

  /// How a job that has been admitted is worked on.
  struct Admitted {
    std::string id;
    std::stop_token stop;  ///< Requested when the job ends before its work does.
    std::shared_ptr<Progress> progress;
    /// What its passes take is counted until no copy of this is left, however the job ends meanwhile.
    std::shared_ptr<const void> passes_memory;
    /// What else it takes is booked as long.
    std::shared_ptr<const void> memory = {};
    /// Of one that is to be written down: what became of that. One that can't be is there no longer by then.
    Told written = {};
  };

  /// Adds a queued job, or refuses: `too_many_jobs`, `out_of_memory_budget` when those that haven't ended leave no
  /// memory for its image, `shutting_down`; `quota_exceeded` where the order's owner has `most_of_owner` jobs that
  /// haven't ended. What it `needs` is let go when it ends. One that isn't `kept` ends when nobody holds it any more.
  /// One that is, is refused later when it can't be written down (`Admitted::written`): `insufficient_storage`,
  /// `storage_unavailable`. No client may be told of it before.
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
  /// From now on the job goes on whoever lets it go, and is written down: it waits for that. False when the job has
  /// ended; refused like one that is added, and then it isn't kept.
  proto::Result<bool> keep(const std::string& id);

  /// Who waits for a job.
  struct Waiter {
    /// Called once, by whatever thread brings the job so far.
    virtual void told() noexcept = 0;
    Waiter* next = nullptr;

   protected:
    ~Waiter() = default;
  };
  /// What is waited for: that it is settled whether the job is in the journal, or that it has ended.
  enum class Until { written, ended };
  /// From now on `waiter` waits, and lives until it has been told. False, and it doesn't wait, when the job is so far,
  /// isn't there, or won't end before this daemon does. Takes no memory.
  bool wait(const std::string& id, Waiter& waiter, Until until = Until::ended);
  /// `waiter` waits no longer; false when it has been told meanwhile, or is being told.
  bool stop_waiting(const std::string& id, Waiter& waiter);

  /// Why `add` would refuse a job now that has the image of these settings, or one like the average of those that
  /// haven't ended, if that is smaller.
  std::optional<proto::Problem> refusal(const Settings& settings) const;

  /// Steps of a job's work. False, and nothing is changed, when it has ended or been deleted meanwhile: there is
  /// nothing left to do for it.
  bool is_unfinished(const std::string& id);
  bool start_preparing(const std::string& id);
  bool set_plan(const std::string& id, std::shared_ptr<const PlanReport> plan,
                std::shared_ptr<const ObjectMarks> tested);
  bool start_rendering(const std::string& id, std::optional<StructureUse> structure, std::shared_ptr<const Film> film);
  /// `structure` is what it has come to be by the end. Where files are kept, the image of a job that is written down
  /// has to be on disk, or to go into the journal with its end: false where neither is so. Such a job completes a
  /// moment later.
  bool complete(const std::string& id, std::optional<StructureUse> structure = std::nullopt,
                const KeptImage& image = {});
  /// Takes no memory.
  bool fail(const std::string& id, std::string why);

  /// Ends a job early: `not_found` or `job_already_ended` when that can't be. What it has rendered stays. Waits for
  /// that to be written down; `insufficient_storage` or `storage_unavailable` when it can't be yet, though the job has
  /// ended.
  proto::Result<JobView> cancel(const std::string& id);

  /// Forgets a job that has ended, or says why not. Waits for that to be written down.
  std::optional<proto::Problem> remove(const std::string& id);

  /// `not_found` for an unknown id, `gone` for that of a job that has expired.
  proto::Result<JobView> find(const std::string& id) const;

  /// Whether a job is in the journal.
  bool is_written(const std::string& id) const;
  /// Whether the next daemon will work on it.
  bool goes_on_later(const std::string& id) const;

  /// It was tried to deliver a job's webhook. Whether the job is still there.
  bool webhook_tried(const std::string& id, JobEvent::WebhookTried tried);

  /// What there is of a job's image, for as long as the caller wants it; null when it is on disk alone. `image_gone`
  /// when it gave way, `image_not_ready` when there is nothing of it, `not_found` for an unknown id.
  proto::Result<std::shared_ptr<const Film>> film(const std::string& id) const;
  /// Counts an image that was read from the disk, as long as somebody has it.
  void lend(const std::shared_ptr<const Film>& film, std::uint64_t bytes);
  /// The image of a job that has completed isn't on disk as it was written: it is to be rendered again, which `needs`
  /// this. False for one that wouldn't be the same; its image is gone.
  bool render_again(const std::string& id, std::shared_ptr<const void> needs);

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

  /// Has the image of a job that has ended give way at once, on disk as well: nobody will want it again.
  void let_image_go(const std::string& id);

  /// A request that may have been sent before.
  struct Retry {
    enum class Is { first, in_progress, another_request, known } is;
    std::string job = {};  ///< Where it is known.
    /// Where it is the first: as long as this lives, others are told that it is in progress.
    std::shared_ptr<const void> claim = {};
  };
  Retry claim(const RetryKey& key);

  /// What has happened to them, for those who watch.
  EventFeed& events() { return events_; }

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

  /// How long what has ended stays, and work may take; 0 is no limit.
  struct Retention {
    std::chrono::seconds job_age{0};    ///< Since a job has ended; then it expires.
    std::chrono::seconds image_age{0};  ///< The same for its image alone.
    std::uint64_t image_bytes = 0;      ///< Of all images that are on disk; the oldest give way.
    std::chrono::seconds work{0};       ///< Since work on a job has begun; then it fails.
  };
  /// Has that be so at this moment. To be called now and then.
  void look_after(const Retention& retention, JobTimes::Clock::time_point now = JobTimes::Clock::now());

  /// In force for what comes from now on: nothing ends, or is refused afterwards, because of smaller ones.
  void set_limits(const Limits& limits);

  /// Admits no more jobs.
  void close();

  /// Admits no more jobs and has work on those stop that haven't ended: those that are written down go on when the next
  /// daemon starts, the others are canceled.
  void shut_down();

  /// What happened to a job before this daemon started; in the order in which it did, before anything else is asked.
  /// Throws std::exception for what can't have happened; then nothing has changed.
  void restore(const std::string& id, const JobEvent& event, std::uint64_t seq);
  /// After that: queues those again that hadn't ended, each with what it `needs`, and says which those are, in the
  /// order in which they came. `needs` is called with the mutex held.
  std::vector<std::string> queue_again(const std::function<std::shared_ptr<const void>(const JobOrder& order)>& needs);
  /// To work on such a job; nothing when it has ended meanwhile.
  std::optional<Admitted> take_up(const std::string& id);

 private:
  struct Job {
    JobView view;
    bool kept = true;
    std::shared_ptr<const void> needs;  ///< Until it ends.
    bool is_written = false;            ///< In the journal, or about to be:
    bool is_settled = false;            ///< there for good.
    bool is_suspended = false;          ///< No work is done on it: the next daemon goes on.
    bool has_image = false;             ///< On disk.
    Told ending;                        ///< Once its end waits to be written; it tells what became of that.
    std::uint32_t holds = 0;
    Waiter *waiters = nullptr, *writing_waiters = nullptr;  ///< Lists through `next`.
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
    std::list<std::string> forgotten;
    const std::function<void(const std::string&)>* forget = nullptr;
    Waiter* told = nullptr;
    EventFeed::Audience audience;
  };

  std::string new_id();
  std::uint32_t unfinished_of(std::string_view owner) const;
  Admitted admitted(Job& job) const;

  // What has happened:

  /// The one function that changes what a job is. Nothing happens to one that has ended but that it is removed. Takes
  /// no memory but for a job that is queued, and for what is wrong with its webhook.
  void apply(const std::string& id, const JobEvent& event, Aftermath& after);
  /// The same for what happens now: it is logged and counted.
  void apply_now(const std::string& id, const JobEvent& event, Aftermath& after);
  void set_state(Job& job, proto::JobState state);
  void begin(const std::string& id, const JobEvent& event, const JobEvent::Queued& queued);
  void end(Job& job, const JobEvent::Ended& ended, Aftermath& after);
  void begin_again(Job& job, Aftermath& after);
  void give_up_image(Job& job, Aftermath& after);
  void forget_files(const Job& job, Aftermath& after);
  static void tell(Waiter*& waiters, Aftermath& after);

  // What happens:

  static JobEvent now(const Job& job, decltype(JobEvent::what) what);
  /// Who watches is told of what has happened to a job, if that is a step; `seq` where it is written down.
  void announce(const std::string& id, const JobEvent& event, std::optional<std::uint64_t> seq, Aftermath& after);
  /// Has an event written down, and then announced; `then` is called after each try.
  void write(const std::string& id, const JobEvent& event, Journal::OnFailure on_failure, bool is_awaited,
             const std::function<void(const Outcome&)>& then = nullptr);
  /// The same, to wait for the first try.
  Told write_and_tell(const std::string& id, const JobEvent& event, Journal::OnFailure on_failure,
                      const std::function<void(const Outcome&)>& then = nullptr);
  /// A step of a job's work.
  bool happen(Job& job, decltype(JobEvent::what) what, Aftermath& after);
  /// A job's end, at once, or when it has been written down. False when it has ended, or is about to.
  bool finish(Job& job, JobEvent::Ended how, Aftermath& after);
  void has_been_written(const std::string& id, const JobEvent& end, const Outcome& outcome);
  /// A job that couldn't be written down was never there.
  void has_been_queued(const std::string& id, const Outcome& outcome);
  /// Forgets those that ended first, if there are too many.
  void forget_oldest(Aftermath& after);
  /// Forgets one that has ended, and keeps in mind that it was there.
  void expire(Jobs::iterator ended, Aftermath& after);
  void remember_expired(const std::string& id);
  /// Why a job can't be found.
  proto::Problem absent(const std::string& id) const;
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
  /// One that is worked on.
  Job* find_at_work(const std::string& id);
  void let_go(const std::string& id) noexcept;

  Journal* const journal_;
  const std::function<void(const std::string&)> forget_;
  EventFeed events_;
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
  std::map<std::string, std::string> retries_;  ///< Ids of jobs by the keys that they were sent with.
  std::set<std::string> claimed_;               ///< Keys of requests in progress.
  std::set<std::string> expired_;               ///< The latest jobs that have.
  std::uint32_t unfinished_ = 0;
  std::array<std::uint32_t, 6> by_state_{};  ///< Jobs, indexed by `JobState`.
  std::uint64_t last_time_ = 0;
  bool closed_ = false;
};

}  // namespace tessera::server
