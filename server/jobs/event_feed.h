#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tessera::server {

/// Where an event stands among all that are told.
struct EventId {
  std::uint64_t seq = 0;  ///< In the journal; of one that isn't written there, of the last before it that is,
  std::uint64_t sub = 0;  ///< and how many that aren't have come since. 0 of one that is.

  auto operator<=>(const EventId&) const = default;
};
/// "17", "17.2".
std::string text_of(EventId id);
std::optional<EventId> read_event_id(std::string_view text);

/// What jobs go through. A job that ends early leaves some out.
enum class JobStep { queued, preparing, rendering, ended };
inline constexpr std::size_t kJobSteps = 4;

/// What those are told who watch jobs: the steps that jobs have come to, in one order. A step of a job that is written
/// down is told once it is in the journal, and has its number there: so what was told outlives the daemon, and whoever
/// asks again, knowing the last number, goes on from there. Nothing is queued for anybody: who is slow finds all steps
/// of the jobs that there are when it looks. Safe to call from any number of threads; calls nobody with its lock held.
class EventFeed {
 public:
  EventFeed() = default;
  EventFeed(const EventFeed&) = delete;

  /// Who waits for something to happen.
  struct Watcher {
    /// Called once for each time that it began to watch, by any thread.
    virtual void told() noexcept = 0;
    Watcher* next = nullptr;

   protected:
    ~Watcher() = default;
  };
  /// Those who are to be told, by whoever has them, when it holds no lock.
  class Audience {
   public:
    Audience() = default;
    Audience(Audience&& other) noexcept : first_(std::exchange(other.first_, nullptr)) {}
    ~Audience();
    /// Joins others to these.
    void add(Audience&& others) noexcept;

   private:
    friend class EventFeed;
    explicit Audience(Watcher* first) : first_(first) {}
    Watcher* first_ = nullptr;
  };

  // What the table of jobs says:

  /// A job is there. What it takes is taken now: nothing but this needs memory.
  void add(const std::string& job, const std::string& owner);
  /// A job has come to a step, with this number in the journal, if any. One that is queued again begins anew.
  [[nodiscard]] Audience happened(const std::string& job, JobStep step, std::optional<std::uint64_t> seq) noexcept;
  /// What is told from now on has greater numbers.
  void begin_after(std::uint64_t seq);
  /// A job isn't there any more, and
  [[nodiscard]] Audience forget(const std::string& job) noexcept;
  /// that is to be told. The last 10,000 are kept, as in the journal.
  [[nodiscard]] Audience removed(const std::string& job, const std::string& owner, bool expired,
                                 std::optional<std::uint64_t> seq) noexcept;
  /// Nothing happens any more.
  [[nodiscard]] Audience close() noexcept;

  // What watchers ask:

  /// What is told last, so far.
  EventId last() const;

  /// The steps of a job that have been told, where it has come to them.
  using Steps = std::array<std::optional<EventId>, kJobSteps>;
  Steps steps_of(const std::string& job) const;

  /// A step of a job, or its end: it was deleted, or has expired.
  struct Event {
    EventId id;
    std::string job;
    std::optional<JobStep> step;  ///< Nothing where it is there no more.
    bool expired = false;
  };
  /// At most `limit` events after one, of the jobs of an owner, if given. Goes on behind the last that it looked at.
  std::vector<Event> after(EventId& last, std::size_t limit, const std::optional<std::string>& owner) const;

  /// At most `limit` jobs that render, behind `after`, in order.
  std::vector<std::string> rendering(std::string_view after, std::size_t limit,
                                     const std::optional<std::string>& owner) const;

  /// From now on `watcher` watches a job, or all: until it is told, and it lives until then. False, and it doesn't,
  /// when nothing will happen any more. Takes no memory.
  bool watch(const std::optional<std::string>& job, Watcher& watcher) noexcept;
  /// It watches no longer; false when it has been told meanwhile, or is being told.
  bool stop_watching(const std::optional<std::string>& job, Watcher& watcher) noexcept;

 private:
  struct Job;
  struct Told {
    const std::string* job;
    Job* entry;
    JobStep step;
  };
  using Order = std::map<EventId, Told>;
  struct Removal {
    std::string job, owner;
    bool expired;
  };
  using Rendering = std::map<std::string, const Job*, std::less<>>;
  struct Job {
    std::string owner;
    Steps steps;
    std::array<Order::node_type, kJobSteps> spare;  ///< For steps that it hasn't come to.
    Rendering::node_type spare_rendering;           ///< Unless it renders.
    Watcher* watchers = nullptr;                    ///< A list through `next`.
  };
  using Jobs = std::map<std::string, Job, std::less<>>;

  EventId next_id(std::optional<std::uint64_t> seq) noexcept;
  void take_back(Job& job, JobStep step) noexcept;
  void stop_rendering(const std::string& name, Job& job) noexcept;
  Watcher** list_of(const std::optional<std::string>& job) noexcept;

  mutable std::mutex mutex_;  ///< Guards what follows.
  Jobs jobs_;
  Order order_;
  std::map<EventId, Removal> removals_;
  Rendering rendering_;
  EventId last_;
  Watcher* watchers_ = nullptr;  ///< Of all jobs; a list through `next`.
  bool closed_ = false;
};

}  // namespace tessera::server
