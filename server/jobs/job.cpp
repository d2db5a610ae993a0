#include "server/jobs/job.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "server/rfc3339.h"
#include "server/webhooks/webhook_target.h"

namespace tessera::server {
namespace {

/// As long as there is no image, however little is left.
constexpr double kMostBeforeTheImage = 0.99;

/// The part by which the time that is left is taken to be more or less than the speed so far makes it, when all kinds
/// of tiles have been seen (`tests/bench eta` tells how often it is), and the seconds that the end takes by itself.
constexpr double kSpeedVaries = 0.25, kToFinish = 0.05, kWrittenBytesPerSecond = 300e6;

constexpr std::array kRays{&RayCounts::camera,        &RayCounts::camera_hits, &RayCounts::reflection,
                           &RayCounts::refraction,    &RayCounts::shadow,      &RayCounts::scattered,
                           &RayCounts::camera_skipped};
static_assert(sizeof(RayCounts) == kRays.size() * sizeof(std::uint64_t), "every member is told");

std::uint64_t samples_of(const Settings& settings) {
  return std::uint64_t{settings.width} * settings.height * settings.samples;
}

/// Seconds to go until an image has all of its samples.
struct TimeLeft {
  double as_before;  ///< If camera rays still to be traced take as long as those that were.
  double alone;      ///< If all threads work on it from now on, as fast as they do.
};

/// Until the image has so many samples. Those of empty tiles cost next to nothing, so they don't count.
std::optional<TimeLeft> time_until(double samples, const JobView& job, JobTimes::Clock::time_point now) {
  if (job.state != proto::JobState::rendering || !job.plan) return std::nullopt;
  const Progress::Pace pace = job.progress->pace();
  if (pace.camera_rays == 0) return std::nullopt;
  const double part_traced =
      static_cast<double>(job.plan->camera_rays) / static_cast<double>(samples_of(job.order->settings));
  const double rays = std::max(0.0, samples * part_traced - static_cast<double>(job.progress->rays().camera));
  const double times_as_many = rays / static_cast<double>(pace.camera_rays);
  const double spent = std::chrono::duration<double>(now - *job.times.rendering).count();
  return TimeLeft{spent * times_as_many, std::min(spent, pace.seconds) * times_as_many};
}

/// The part by which the speed may change: some parts of the image cost more than others, and as long as few of its
/// tiles have been seen there may be any.
double speed_varies(const JobView& job, const PassReport& passes) {
  return kSpeedVaries + (passes.passes == 0 ? 1 / std::sqrt(1 + static_cast<double>(job.progress->tiles())) : 0);
}

/// Until the image is there, which has all of its samples when it has between `low` and `high`; and what is as likely
/// to be too much as too little.
void tell_time_left(double low, double high, const PassReport& passes, const JobView& job,
                    JobTimes::Clock::time_point now, proto::JobStatus& status) {
  const auto least = time_until(low, job, now), middle = time_until(std::sqrt(low * high), job, now),
             most = time_until(high, job, now);
  if (!least || !middle || !most) return;
  const double varies = speed_varies(job, passes);
  status.eta = middle->as_before;
  status.eta_range = proto::Range{least->alone * std::max(0.0, 1 - varies), most->as_before * (1 + varies)};
  if (const auto& limit = job.order->settings.seconds) {
    const double in_time = std::max(0.0, *limit - std::chrono::duration<double>(now - *job.times.rendering).count());
    // What is rendered until then is settled from pass to pass; so the time says more than samples do.
    const bool ends_in_time = high < static_cast<double>(samples_of(job.order->settings));
    status.eta_range->low = std::min(status.eta_range->low, in_time * (1 - kSpeedVaries));
    status.eta = ends_in_time && !job.order->settings.error ? in_time : std::min(*status.eta, in_time);
    status.eta_range->high = ends_in_time ? in_time : std::min(status.eta_range->high, in_time);
  }
  const double writing = static_cast<double>(image_bytes(job.order->settings)) / kWrittenBytesPerSecond;
  status.eta = *status.eta + writing;
  status.eta_range->low += writing / 2;
  status.eta_range->high += 2 * writing + kToFinish;
}

std::string_view name(EndedBy by) {
  switch (by) {
    case EndedBy::samples:
      return "samples";
    case EndedBy::error:
      return "error";
    case EndedBy::seconds:
      break;
  }
  return "seconds";
}

/// What passes say of a job: how much of it is done, what is left, and how good it is by now.
void tell_passes(const JobView& job, JobTimes::Clock::time_point now, proto::JobStatus& status) {
  const PassReport passes = job.progress->passes();
  const auto most = static_cast<double>(samples_of(job.order->settings));
  const auto done = static_cast<double>(status.samples_done);
  const double pixels = static_cast<double>(status.width) * status.height;
  // Before they begin, nothing is known but what was asked for.
  const bool has_begun = passes.high_total > 0, may_be_less = measures_error(job.order->settings);
  const double low = std::max(done, has_begun ? static_cast<double>(passes.low_total) : may_be_less ? pixels : most);
  const double high = std::max(done, has_begun ? static_cast<double>(passes.high_total) : most);
  const double middle = std::sqrt(low * high);
  status.passes = passes.passes;
  const bool is_complete = job.state == proto::JobState::completed;
  status.progress = is_complete ? 1 : job.progress->furthest(std::min(done / middle, kMostBeforeTheImage));
  status.progress_range = {std::min(done / high, status.progress), std::max(done / low, status.progress)};
  tell_time_left(low, high, passes, job, now, status);
  if (passes.ended_by) status.ended_by = name(*passes.ended_by);
  if (passes.error) status.achieved = proto::Achieved{passes.error->error, {passes.error->low, passes.error->high}};
  status.samples_per_pixel = {passes.least, static_cast<double>(passes.samples) / pixels, passes.most};
}

}  // namespace

Progress::Progress(const JobFigures& figures)
    : tiles_(figures.tiles), broken_textures_(figures.broken_textures), cores_(figures.cores), passes_(figures.passes) {
  add({figures.rays, figures.tests, figures.samples}, {});
}

void Progress::add(const Done& done, const Done& before) {
  for (std::size_t i = 0; i < rays_.size(); ++i) rays_[i] += done.rays.*kRays[i] - before.rays.*kRays[i];
  volume_tests_ += done.tests.volume_tests - before.tests.volume_tests;
  volume_hits_ += done.tests.volume_hits - before.tests.volume_hits;
  object_tests_ += done.tests.object_tests - before.tests.object_tests;
  object_hits_ += done.tests.object_hits - before.tests.object_hits;
  false_hits_ += done.tests.false_hits - before.tests.false_hits;
  samples_ += done.samples - before.samples;
}

void Progress::add_tile(PixelRect where) {
  const std::lock_guard lock(passes_mutex_);
  recent_.push_back(where);
  if (recent_.size() > kRecentTiles) recent_.pop_front();
  tiles_.fetch_add(1, std::memory_order_release);
}

void Progress::complete_tiles(std::uint64_t all) {
  const std::lock_guard lock(passes_mutex_);
  recent_.clear();
  tiles_.store(all, std::memory_order_release);
}

std::vector<PixelRect> Progress::recent_tiles(std::uint64_t& told) const {
  const std::lock_guard lock(passes_mutex_);
  const std::uint64_t all = tiles_, more = all - std::min(std::exchange(told, all), all);
  return {recent_.end() - static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(more, recent_.size())), recent_.end()};
}

RayCounts Progress::rays() const {
  RayCounts counts;
  for (std::size_t i = 0; i < rays_.size(); ++i) counts.*kRays[i] = rays_[i];
  return counts;
}

TestCounts Progress::tests() const {
  TestCounts counts;
  counts.volume_tests = volume_tests_;
  counts.volume_hits = volume_hits_;
  counts.object_tests = object_tests_;
  counts.object_hits = object_hits_;
  counts.false_hits = false_hits_;
  return counts;
}

void Progress::start_rendering(unsigned threads) {
  rays_before_ = rays().camera;
  threads_ = threads;
}

Progress::Pace Progress::pace() const {
  const std::chrono::duration<double> spent = std::chrono::steady_clock::duration(thread_time_);
  return {rays().camera - rays_before_, spent.count() / threads_};
}

double Progress::furthest(double part) const {
  double before = furthest_;
  while (before < part && !furthest_.compare_exchange_weak(before, part)) continue;
  return std::max(before, part);
}

void Progress::set_passes(const PassReport& passes) {
  const std::lock_guard lock(passes_mutex_);
  passes_ = passes;
}

void Progress::add_core_seconds(const CoreSeconds& more) {
  const std::lock_guard lock(passes_mutex_);
  cores_.busy += more.busy;
  cores_.idle += more.idle;
}

CoreSeconds Progress::core_seconds() const {
  const std::lock_guard lock(passes_mutex_);
  return cores_;
}

PassReport Progress::passes() const {
  const std::lock_guard lock(passes_mutex_);
  return passes_;
}

PlanReport report(const Plan& plan, const Scene& scene, const Settings& settings) {
  PlanReport report{};
  report.accel = plan.accel;
  report.accel_because = plan.accel_because;
  report.candidates = plan.candidates;
  report.needs_structure = needs_structure(plan);
  report.tiles = plan.tiling.tiles.size();
  report.smallest_tile = report.tiles == 0 ? 0 : samples_of(settings);
  for (const Tile& tile : plan.tiling.tiles) {
    const auto pixels = static_cast<std::uint64_t>(tile.rect.area());
    report.smallest_tile = std::min(report.smallest_tile, pixels);
    report.largest_tile = std::max(report.largest_tile, pixels);
    if (tile.first_level == FirstLevel::nothing) ++report.tiles_empty;
    if (tile.first_level == FirstLevel::candidates) ++report.tiles_with_candidates;
    if (tile.first_level != FirstLevel::nothing) report.camera_rays += pixels * settings.samples;
  }
  report.objects = scene.objects.size();
  report.objects_on_screen = plan.tiling.objects_on_screen;
  report.primitives = plan.primitives;
  report.skips = plan.skips;
  return report;
}

std::uint64_t image_bytes(const Settings& settings) {
  constexpr std::uint64_t kTileBytes = 100;  // In the film and, as long as it is rendered, in the plan.
  const auto across = [&](std::uint64_t pixels) { return (pixels + settings.tile_size - 1) / settings.tile_size; };
  const std::uint64_t tiles =
      settings.tile_size == kAdaptiveTiles ? 0 : across(settings.width) * across(settings.height);
  return Film::memory_bytes(settings.width, settings.height, settings.aovs) + tiles * kTileBytes;
}

std::uint64_t passes_bytes(const Settings& settings) { return Passes::memory_bytes(settings); }

proto::JobStatus status_of(const JobView& job, JobTimes::Clock::time_point now) {
  const std::chrono::duration<double> elapsed = job.times.ended.value_or(now) - job.times.queued;
  proto::JobStatus status;
  status.id = job.id;
  status.name = job.order->name;
  status.priority = name_of(proto::priority_names(), job.order->priority);
  status.state = job.state;
  status.image = job.image;
  status.scene = job.order->scene_hash;
  status.width = job.order->settings.width;
  status.height = job.order->settings.height;
  status.tiles_done = job.progress->tiles();
  status.tiles_total = job.plan ? job.plan->tiles : 0;
  status.samples_done = job.progress->samples();
  status.samples_total = samples_of(job.order->settings);
  status.elapsed = elapsed.count();
  tell_passes(job, now, status);
  status.created = rfc3339(job.times.created);
  status.error = job.error;
  status.warnings = job.order->warnings + job.progress->broken_textures();
  if (const std::string& url = job.order->webhook; !url.empty())
    status.webhook = {std::string(host_of_webhook(url)), job.webhook.state, job.webhook.attempts, job.webhook.error};
  return status;
}

}  // namespace tessera::server
