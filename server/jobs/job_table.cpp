#include "server/jobs/job_table.h"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <new>
#include <random>
#include <stdexcept>
#include <utility>

#include <spdlog/spdlog.h>

#include "proto/wire/abandoned.h"
#include "server/metrics/metrics.h"

namespace tessera::server {
using proto::JobState;
using proto::Problem;
using proto::ProblemCode;

namespace {

std::size_t index_of(JobState state) { return static_cast<std::size_t>(state); }

/// Whether the state machine has this edge.
bool may_follow(JobState from, JobState to) {
  if (proto::has_ended(from)) return false;
  switch (to) {
    case JobState::queued:
      return false;
    case JobState::preparing:
      return from == JobState::queued;
    case JobState::rendering:
      return from == JobState::preparing;
    case JobState::completed:
      return from == JobState::rendering;
    case JobState::failed:
    case JobState::canceled:
      return true;
  }
  return false;
}

/// Counted as long as it lives, for longer than the table if need be.
class PassesMemory {
 public:
  PassesMemory(std::shared_ptr<std::atomic<std::uint64_t>> all, std::uint64_t bytes)
      : all_(std::move(all)), bytes_(bytes) {
    *all_ += bytes_;
  }
  ~PassesMemory() { *all_ -= bytes_; }
  PassesMemory(const PassesMemory&) = delete;

 private:
  std::shared_ptr<std::atomic<std::uint64_t>> all_;
  std::uint64_t bytes_;
};

}  // namespace

Problem no_such_job() { return {ProblemCode::not_found, "There is no job with this id; GET /v1/jobs lists all.", {}}; }

std::string JobTable::new_id() {
  // 48 bits of time, made to grow, then 80 random bits: sorts by arrival, and can't be guessed.
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  const auto now = std::chrono::duration_cast<std::chrono::milliseconds>(since_epoch).count();
  last_time_ = std::max(last_time_ + 1, static_cast<std::uint64_t>(now));
  std::random_device random;
  char id[33];
  std::snprintf(id, sizeof id, "%012llx%04x%08x%08x", static_cast<unsigned long long>(last_time_ & 0xFFFF'FFFF'FFFF),
                random() & 0xFFFF, random(), random());
  return id;
}

std::uint64_t JobTable::leaving() {
  std::erase_if(leaving_, [](const auto& film) { return film.first.expired(); });
  std::uint64_t bytes = copies_bytes_;
  for (const auto& film : leaving_) bytes += film.second;
  return bytes;
}

void JobTable::make_room(std::uint64_t film, Aftermath& after) {
  // Films that are still being read are few, for an image is read by a thread that encodes it, and soon gone: more
  // ended ones make room for them, but no job is refused for them.
  for (std::uint64_t others = leaving() + film;
       !ended_images_.empty() && taken() + ended_bytes_ + others > limits_.film_bytes; others = leaving() + film)
    drop_film(jobs_.find(ended_images_.front())->second, after);
}

std::optional<Problem> JobTable::refusal_of(std::uint64_t film) const {
  if (closed_)
    return Problem{ProblemCode::shutting_down, "The server is about to stop; submit the job again soon.", {}};
  if (unfinished_ >= limits_.unfinished_jobs)
    return Problem{ProblemCode::too_many_jobs,
                   std::to_string(unfinished_) + " jobs haven't ended; submit this one when fewer are left.",
                   {}};
  if (film > limits_.film_bytes - std::min(taken(), limits_.film_bytes))
    return Problem{ProblemCode::out_of_memory_budget,
                   "The images of jobs that haven't ended fill the memory set aside for images; submit this one when "
                   "fewer are left.",
                   {}};
  return std::nullopt;
}

std::optional<Problem> JobTable::refusal(const Settings& settings) const {
  std::uint64_t film = image_bytes(settings) + passes_bytes(settings);
  const std::lock_guard lock(mutex_);
  if (unfinished_ > 0) film = std::min(film, taken() / unfinished_);
  return refusal_of(std::min(film, limits_.film_bytes));
}

std::uint32_t JobTable::unfinished_of(std::string_view owner) const {
  std::uint32_t count = 0, left = unfinished_;  // They are among the latest, most often.
  for (auto at = jobs_.rbegin(); at != jobs_.rend() && left > 0; ++at) {
    if (proto::has_ended(at->second.view.state)) continue;
    --left;
    if (at->second.view.order->owner == owner) ++count;
  }
  return count;
}

proto::Result<JobTable::Admitted> JobTable::add(JobOrder order, bool kept, std::optional<std::uint32_t> most_of_owner,
                                                std::shared_ptr<const void> needs) {
  const std::uint64_t image = image_bytes(order.settings), passes = passes_bytes(order.settings);
  const std::uint64_t film = image + passes;
  Aftermath after;
  const std::lock_guard lock(mutex_);
  if (auto problem = refusal_of(film)) return *std::move(problem);
  if (most_of_owner && unfinished_of(order.owner) >= *most_of_owner)
    return Problem{ProblemCode::quota_exceeded,
                   "As many of " + order.owner +
                       "'s jobs haven't ended as this key may have; submit this one when fewer are left.",
                   {}};
  make_room(film, after);

  Job job;
  job.kept = kept;
  job.needs = std::move(needs);
  job.progress = std::make_shared<Progress>();
  job.film_bytes = image;
  job.view.id = new_id();
  job.view.order = std::make_shared<const JobOrder>(std::move(order));
  job.view.progress = job.progress;
  job.spare_nodes = {job.view.id, job.view.id};
  job.view.times.created = std::chrono::system_clock::now();
  job.view.times.queued = JobTimes::Clock::now();
  Admitted admitted{job.view.id, job.stop.get_token(), job.progress,
                    std::make_shared<const PassesMemory>(passes_bytes_, passes)};
  spdlog::info("job {}: queued", job.view.id);
  jobs_.emplace(admitted.id, std::move(job));
  unfinished_bytes_ += image;
  ++unfinished_;
  ++by_state_[index_of(JobState::queued)];
  return admitted;
}

JobTable::Aftermath::~Aftermath() {
  while (told) std::exchange(told, told->next)->job_has_ended();
}

std::shared_ptr<const JobTable::Hold> JobTable::hold(const std::string& id) {
  auto hold = std::make_shared<const Hold>(*this, id);
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return nullptr;  // What let it go finds nothing either.
  ++found->second.holds;
  return hold;
}

void JobTable::let_image_go(const std::string& id) {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found != jobs_.end() && proto::has_ended(found->second.view.state) && found->second.film)
    drop_film(found->second, after);
}

void JobTable::let_go(const std::string& id) noexcept {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return;
  Job& job = found->second;
  if (--job.holds == 0 && !job.kept) end(job, JobState::canceled, after);
}

void JobTable::keep(const std::string& id) {
  const std::lock_guard lock(mutex_);
  if (Job* job = find_unfinished(id)) job->kept = true;
}

bool JobTable::wait(const std::string& id, Waiter& waiter) {
  const std::lock_guard lock(mutex_);
  Job* job = find_unfinished(id);
  if (!job) return false;
  waiter.next = std::exchange(job->waiters, &waiter);
  return true;
}

bool JobTable::stop_waiting(const std::string& id, Waiter& waiter) {
  const std::lock_guard lock(mutex_);
  Job* job = find_unfinished(id);
  if (!job) return false;
  for (Waiter** at = &job->waiters; *at; at = &(*at)->next)
    if (*at == &waiter) {
      *at = waiter.next;
      return true;
    }
  return false;
}

bool JobTable::change_state(Job& job, JobState to) {
  JobView& view = job.view;
  if (proto::has_ended(view.state)) return false;
  if (!may_follow(view.state, to))
    throw std::logic_error(std::string(proto::name(view.state)) + " can't become " + std::string(proto::name(to)));
  --by_state_[index_of(view.state)];
  ++by_state_[index_of(to)];
  view.state = to;
  const auto now = JobTimes::Clock::now();
  if (to == JobState::preparing) {
    view.times.preparing = now;
    metrics().queue_wait.add(now - view.times.queued);
  }
  if (to == JobState::rendering) view.times.rendering = now;
  if (proto::has_ended(to)) {
    view.times.ended = now;
    metrics().job_ended(to, now - view.times.queued);
    --unfinished_;
    job.stop.request_stop();
    unfinished_bytes_ -= job.film_bytes;
    if (job.film) ended_bytes_ += job.film_bytes;
  }
  spdlog::info("job {}: {}", view.id, proto::name(to));
  return true;
}

bool JobTable::end(Job& job, JobState to, Aftermath& after) {
  if (!change_state(job, to)) return false;
  job.needs.reset();  // At once: who is told of the end may delete it.
  while (job.waiters) {
    Waiter& waiter = *std::exchange(job.waiters, job.waiters->next);
    waiter.next = std::exchange(after.told, &waiter);
  }
  job.among_ended = job.spare_nodes.begin();
  ended_.splice(ended_.end(), job.spare_nodes, job.among_ended);
  if (job.film) {
    job.among_images = job.spare_nodes.begin();
    ended_images_.splice(ended_images_.end(), job.spare_nodes, job.among_images);
  }
  try {
    while (ended_.size() > limits_.ended_jobs) drop(jobs_.find(ended_.front()), after);
  } catch (const std::bad_alloc&) {  // The next job that ends makes up for it.
  }
  return true;
}

void JobTable::drop_film(Job& job, Aftermath& after) {
  try {
    if (job.film.use_count() > 1) leaving_.emplace_back(job.film, job.film_bytes);
    after.films.push_back(job.film);
  } catch (const std::bad_alloc&) {  // Then it isn't counted any more, or freed here.
  }
  job.film.reset();
  ended_bytes_ -= job.film_bytes;
  ended_images_.erase(job.among_images);
  job.view.image = proto::ImageState::gone;
}

void JobTable::drop(Jobs::iterator ended, Aftermath& after) {
  Job& job = ended->second;
  if (job.film) drop_film(job, after);
  --by_state_[index_of(job.view.state)];
  ended_.erase(job.among_ended);
  jobs_.erase(ended);
}

JobTable::Job* JobTable::find_unfinished(const std::string& id) {
  const auto found = jobs_.find(id);
  return found == jobs_.end() || proto::has_ended(found->second.view.state) ? nullptr : &found->second;
}

bool JobTable::is_unfinished(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  return found != jobs_.end() && !proto::has_ended(found->second.view.state);
}

bool JobTable::start_preparing(const std::string& id) {
  const std::lock_guard lock(mutex_);
  Job* job = find_unfinished(id);
  return job && change_state(*job, JobState::preparing);
}

bool JobTable::set_plan(const std::string& id, std::shared_ptr<const PlanReport> plan,
                        std::shared_ptr<const ObjectMarks> tested) {
  const std::lock_guard lock(mutex_);
  Job* job = find_unfinished(id);
  if (!job) return false;
  job->view.plan = std::move(plan);
  job->view.tested = std::move(tested);
  return true;
}

bool JobTable::start_rendering(const std::string& id, std::optional<StructureUse> structure,
                               std::shared_ptr<const Film> film) {
  const std::lock_guard lock(mutex_);
  Job* job = find_unfinished(id);
  if (!job) return false;
  job->view.structure = structure;
  job->film = std::move(film);
  job->view.image = proto::ImageState::partial;
  return change_state(*job, JobState::rendering);
}

bool JobTable::complete(const std::string& id, std::optional<StructureUse> structure) {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  Job* job = find_unfinished(id);
  if (!job) return false;
  if (structure) job->view.structure = structure;
  if (!end(*job, JobState::completed, after)) return false;
  job->view.image = proto::ImageState::complete;
  return true;
}

bool JobTable::fail(const std::string& id, std::string why) {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  Job* job = find_unfinished(id);
  if (!job) return false;
  spdlog::error("job {}: {}", id, why);
  job->view.error = std::move(why);
  return end(*job, JobState::failed, after);
}

proto::Result<JobView> JobTable::cancel(const std::string& id) {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return no_such_job();
  if (!end(found->second, JobState::canceled, after))
    return Problem{ProblemCode::job_already_ended,
                   "The job is " + std::string(proto::name(found->second.view.state)) + "; there is nothing to cancel.",
                   {}};
  return found->second.view;
}

std::optional<Problem> JobTable::remove(const std::string& id) {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return no_such_job();
  if (!proto::has_ended(found->second.view.state))
    return Problem{ProblemCode::job_still_active,
                   "The job is " + std::string(proto::name(found->second.view.state)) + "; cancel it first.",
                   {}};
  drop(found, after);
  return std::nullopt;
}

proto::Result<JobView> JobTable::find(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return no_such_job();
  return found->second.view;
}

proto::Result<std::shared_ptr<const Film>> JobTable::film(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return no_such_job();
  const Job& job = found->second;
  if (job.film) return job.film;
  if (job.view.image == proto::ImageState::gone)
    return Problem{
        ProblemCode::image_gone,
        "The image gave way to those of younger jobs. Submit the job again and fetch its image sooner, or have "
        "the server set more memory aside (--max-film-memory).",
        {}};
  return Problem{ProblemCode::image_not_ready,
                 "The job is " + std::string(proto::name(job.view.state)) + "; there is nothing of its image.",
                 {}};
}

JobTable::CopyRoom::CopyRoom(JobTable& table, std::uint64_t bytes, const std::stop_token& unwanted)
    : table_(table), bytes_(bytes) {
  std::unique_lock lock(table_.mutex_);
  const auto has_room = [&] {
    return table_.copies_bytes_ == 0 ||
           table_.taken() + table_.ended_bytes_ + table_.leaving() + bytes_ <= table_.limits_.film_bytes;
  };
  if (!table_.copy_gone_.wait(lock, unwanted, has_room)) throw proto::Abandoned();
  table_.copies_bytes_ += bytes_;
}

JobTable::CopyRoom::~CopyRoom() {
  const std::lock_guard lock(table_.mutex_);
  table_.copies_bytes_ -= bytes_;
  table_.copy_gone_.notify_all();
}

bool JobTable::has_job_of(std::string_view owner, const proto::ContentHash& scene) const {
  const std::lock_guard lock(mutex_);
  return std::ranges::any_of(jobs_, [&](const auto& entry) {
    const JobOrder& order = *entry.second.view.order;
    return order.owner == owner && order.scene_hash == scene;
  });
}

std::vector<JobView> JobTable::list(std::string_view after, std::size_t limit, std::optional<JobState> state,
                                    const std::optional<std::string>& owner) const {
  std::vector<JobView> listed;
  const std::lock_guard lock(mutex_);
  for (auto at = jobs_.upper_bound(after); at != jobs_.end() && listed.size() < limit; ++at)
    if ((!state || at->second.view.state == *state) && (!owner || at->second.view.order->owner == *owner))
      listed.push_back(at->second.view);
  return listed;
}

JobTable::Usage JobTable::usage() {
  const std::lock_guard lock(mutex_);
  return {limits_, by_state_, unfinished_, unfinished_bytes_, ended_bytes_, leaving(), *passes_bytes_};
}

void JobTable::set_limits(const Limits& limits) {
  const std::lock_guard lock(mutex_);
  limits_ = limits;
}

void JobTable::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
}

void JobTable::shut_down() {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  closed_ = true;
  for (auto& [id, job] : jobs_) end(job, JobState::canceled, after);  // The job at hand isn't what is forgotten.
}

}  // namespace tessera::server
