#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/accel/object_marks.h"
#include "core/accel/test_counts.h"
#include "core/bounds/pixel_rect.h"
#include "core/film/passes.h"
#include "core/integrator/ray_counts.h"
#include "core/plan/plan.h"
#include "core/scene/settings.h"
#include "proto/wire/job_status.h"
#include "proto/wire/priority.h"
#include "proto/wire/sha256.h"
#include "server/jobs/ledger.h"
#include "server/store/structure_cache.h"

namespace tessera::server {

/// Seconds of threads, of all of them together: spent on a job, and without anything to do while it was worked on.
struct CoreSeconds {
  double busy = 0, idle = 0;
};

/// What a job has come to, in figures.
struct JobFigures {
  RayCounts rays = {};
  TestCounts tests = {};
  std::uint64_t samples = 0, tiles = 0, broken_textures = 0;
  PassReport passes = {};
  CoreSeconds cores = {};
};

/// What render threads add to while a job runs, and everyone may read.
class Progress {
 public:
  Progress() = default;
  /// Of a job that has ended, or goes on from there.
  explicit Progress(const JobFigures& figures);

  struct Done {
    RayCounts rays = {};
    TestCounts tests = {};
    std::uint64_t samples = 0;
  };
  /// Adds what has been done, but for what had been done `before`.
  void add(const Done& done, const Done& before);
  /// When rendering begins, on so many threads, after all that an earlier daemon has done was added.
  void start_rendering(unsigned threads);
  /// What a thread has rendered at a stretch.
  void add_thread_time(std::chrono::steady_clock::duration spent) { thread_time_ += spent.count(); }
  /// How fast it goes since then.
  struct Pace {
    std::uint64_t camera_rays;  ///< Traced.
    double seconds;             ///< That they would have taken if all threads had been this job's.
  };
  Pace pace() const;
  /// When the tile has all of its samples and all of that has been added.
  void add_tile(PixelRect where);
  /// When no tile will have more.
  void complete_tiles(std::uint64_t all);
  /// Where tiles are that have all of their samples: those after the first `told`, but the last `kRecentTiles` at most,
  /// and none of them once all are complete. `told` becomes how many there are.
  std::vector<PixelRect> recent_tiles(std::uint64_t& told) const;
  static constexpr std::size_t kRecentTiles = 64;

  /// Exact once the job is completed; while it runs, the figures may be of different moments.
  RayCounts rays() const;
  TestCounts tests() const;
  std::uint64_t tiles() const { return tiles_.load(std::memory_order_acquire); }
  std::uint64_t samples() const { return samples_; }

  /// Images of the scene that turned out to be broken when they were needed.
  void set_broken_textures(std::uint64_t count) { broken_textures_ = count; }
  std::uint64_t broken_textures() const { return broken_textures_; }

  /// How far the passes have come: up to the last that is complete.
  void set_passes(const PassReport& passes);
  PassReport passes() const;

  /// As they were when the passes were told last.
  void add_core_seconds(const CoreSeconds& more);
  CoreSeconds core_seconds() const;

  /// The greatest part of the work of which this was ever told that it is done: what is left may turn out to be more
  /// than it seemed, but nobody is to see progress go back.
  double furthest(double part) const;

  /// All of that.
  JobFigures figures() const {
    return {rays(), tests(), samples(), tiles(), broken_textures(), passes(), core_seconds()};
  }

 private:
  std::array<std::atomic<std::uint64_t>, sizeof(RayCounts) / sizeof(std::uint64_t)> rays_{};  ///< Member by member.
  std::atomic<std::uint64_t> samples_{0}, tiles_{0}, broken_textures_{0};
  std::atomic<std::uint64_t> volume_tests_{0}, volume_hits_{0}, object_tests_{0}, object_hits_{0}, false_hits_{0};
  mutable std::atomic<double> furthest_{0};
  std::atomic<std::uint64_t> rays_before_{0};  ///< Camera rays that an earlier daemon has traced.
  std::atomic<unsigned> threads_{1};
  std::atomic<std::chrono::steady_clock::rep> thread_time_{0};
  mutable std::mutex passes_mutex_;
  CoreSeconds cores_;             ///< Guarded by it,
  PassReport passes_;             ///< as are these:
  std::deque<PixelRect> recent_;  ///< The last of the tiles that have all of their samples.
};

/// What a plan came to: kept when the plan itself, with its tiles, is gone.
struct PlanReport {
  AccelOptions accel;
  std::string accel_because;
  std::vector<AccelEstimate> candidates;
  bool needs_structure;
  std::uint64_t tiles, tiles_empty, tiles_with_candidates;
  std::uint64_t smallest_tile, largest_tile;  ///< In pixels.
  std::uint64_t objects, objects_on_screen;
  std::uint64_t primitives;
  std::uint64_t camera_rays;  ///< That will be traced: samples in tiles that aren't empty.
  std::vector<Skip> skips;
};
PlanReport report(const Plan& plan, const Scene& scene, const Settings& settings);

/// By what a request is known to be one that was sent before.
struct RetryKey {
  std::string key;             ///< The Idempotency-Key header, of whom it is.
  proto::ContentHash request;  ///< Of the body.

  bool operator==(const RetryKey&) const = default;
};

/// What a job asked for, settled: never changes.
struct JobOrder {
  std::string name;
  proto::ContentHash scene_hash;
  std::uint64_t warnings;  ///< Of the scene, as it was parsed.
  Settings settings;
  std::chrono::steady_clock::duration parsing{};  ///< How long its document took to become that.
  std::string owner = {};                         ///< Whose job it is; empty where there are no keys.
  /// What was asked for, as a job's document that names the scene by its hash: who reads it comes to the same order.
  std::string document = {};
  std::optional<RetryKey> retry = {};
  Ledger::Need need = {};  ///< Of the memory to work on it.
  proto::Priority priority = proto::Priority::normal;
  std::string webhook = {};  ///< The URL that its end is told to; empty for none.
};

/// The structure that a job traces, in figures.
struct StructureUse {
  AccelOptions options;
  AccelStats stats;
  double build_seconds;  ///< Of whoever built it, with all that has been made since.
  bool shared;           ///< Another job had it built.
};

/// When a job reached its states; absent for one that it hasn't reached, or skipped by ending early.
struct JobTimes {
  using Clock = std::chrono::steady_clock;
  std::chrono::system_clock::time_point created;
  Clock::time_point queued;
  std::optional<Clock::time_point> preparing, rendering, ended;
};

/// How far the delivery of a job's webhook has come. It is due once the job has ended.
struct WebhookProgress {
  proto::WebhookState state = proto::WebhookState::pending;
  std::uint32_t attempts = 0;
  std::string error = {};             ///< Why the last of them failed; empty otherwise.
  JobTimes::Clock::time_point due{};  ///< Not before.
};

/// A job, as one moment shows it.
struct JobView {
  std::string id;
  std::shared_ptr<const JobOrder> order;
  proto::JobState state = proto::JobState::queued;
  JobTimes times;
  std::string error;                          ///< Why it failed; empty otherwise.
  std::shared_ptr<const PlanReport> plan;     ///< Once it has been made.
  std::shared_ptr<const ObjectMarks> tested;  ///< Together with the plan: the objects that rays have been tested with.
  std::uint64_t never_tested = 0;             ///< Objects that none has been, where an earlier daemon has counted them.
  std::optional<StructureUse> structure;      ///< Once it has been built, if the plan needs one; anew at completion.
  proto::ImageState image = proto::ImageState::none;
  std::shared_ptr<const Progress> progress;
  WebhookProgress webhook;  ///< Where the order names one.
};

/// What a job's image takes, with what is kept of its tiles where their size is given: others are fewer than pixels by
/// far.
std::uint64_t image_bytes(const Settings& settings);
/// What its passes take beside that, as long as it is being worked on.
std::uint64_t passes_bytes(const Settings& settings);

/// What `GET /v1/jobs/{id}` says of it at `now`.
proto::JobStatus status_of(const JobView& job, JobTimes::Clock::time_point now);

}  // namespace tessera::server
