#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "server/jobs/job_table.h"
#include "server/jobs/ledger.h"
#include "server/services.h"

namespace tessera::server {

struct PreparedJob;

/// What working on a job will take at most, but for its image and passes: the scene, the structure while it is built,
/// the plan.
Ledger::Need memory_need(const PreparedJob& job);

/// Has jobs begin when there is memory for them. Those that wait are no more than their orders: what they need is read
/// from the disk when their turn comes. That is the order in which they came, but for small ones, which may pass one
/// that doesn't fit yet a few times. Safe to call from any number of threads.
class JobStarter {
 public:
  /// `services` has everything by the time that `run` is called.
  explicit JobStarter(Services& services) : services_(services) {}
  ~JobStarter() { stop(); }
  JobStarter(const JobStarter&) = delete;

  /// Begins to start jobs that wait.
  void run();
  /// Starts no more, and waits for the one at hand: what is left is for the next daemon.
  void stop();

  /// Has a job that is written down, and whose scene is kept, start when its turn comes.
  void add(const std::string& id);

  /// Whether one that is added now waits behind others.
  bool has_waiting() const;
  std::size_t waiting() const;

  /// There may be room for another one.
  void look();

 private:
  struct Waiting {
    std::string id;
    unsigned passed = 0;  ///< How often a later one has gone before it.
  };

  void work_on(const std::stop_token& stop);
  /// Starts a job that waits, or says that there is no memory for it yet. What can't be rendered any more fails.
  bool start(const std::string& id, const std::stop_token& stop);

  Services& services_;
  mutable std::mutex mutex_;  ///< Guards what follows.
  std::condition_variable_any changed_;
  std::list<Waiting> waiting_;
  bool may_start_ = false;  ///< Something has changed since all that wait were tried.
  std::jthread thread_;
};

}  // namespace tessera::server
