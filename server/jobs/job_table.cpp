#include "server/jobs/job_table.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdio>
#include <new>
#include <random>
#include <stdexcept>
#include <utility>

#include <spdlog/spdlog.h>

#include "proto/wire/abandoned.h"

namespace tessera::server {
using proto::JobState;
using proto::Problem;
using proto::ProblemCode;

namespace {

/// The time that an id begins with.
std::uint64_t time_of(const std::string& id) {
  constexpr std::size_t kDigits = 12;
  std::uint64_t time = 0;
  std::from_chars(id.data(), id.data() + std::min(kDigits, id.size()), time, 16);
  return time;
}

/// Whether `new_id` may have made it. Files are named for jobs.
bool is_job_id(const std::string& text) {
  return text.size() == 32 && text.find_first_not_of("0123456789abcdef") == text.npos;
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

JobTable::~JobTable() {
  if (journal_) journal_->close();
}

JobTable::Admitted JobTable::admitted(Job& job) const {
  return {job.view.id, job.stop.get_token(), job.progress,
          std::make_shared<const PassesMemory>(passes_bytes_, passes_bytes(job.view.order->settings))};
}

proto::Result<JobTable::Admitted> JobTable::add(JobOrder order, bool kept, std::optional<std::uint32_t> most_of_owner,
                                                std::shared_ptr<const void> needs) {
  const std::uint64_t film = image_bytes(order.settings) + passes_bytes(order.settings);
  const std::string owner = order.owner;
  const JobEvent event{
      std::chrono::system_clock::now(), {}, JobEvent::Queued{std::make_shared<const JobOrder>(std::move(order))}};
  Aftermath after;
  const std::lock_guard lock(mutex_);
  if (auto problem = refusal_of(film)) return *std::move(problem);
  if (most_of_owner && unfinished_of(owner) >= *most_of_owner)
    return Problem{
        ProblemCode::quota_exceeded,
        "As many of " + owner + "'s jobs haven't ended as this key may have; submit this one when fewer are left.",
        {}};
  make_room(film, after);
  const std::string id = new_id();
  apply(id, event, after);
  Job& job = jobs_.find(id)->second;
  job.kept = kept;
  job.needs = std::move(needs);
  try {
    Admitted added = admitted(job);
    if (kept && journal_) {
      added.written = write_and_tell(id, event, Journal::OnFailure::refuse,
                                     [this, id](const Outcome& outcome) { has_been_queued(id, outcome); });
      job.is_written = true;
    } else {
      announce(id, event, std::nullopt, after);
    }
    spdlog::info("job {}: queued", id);
    return added;
  } catch (const std::bad_alloc&) {
    end(job, {JobState::canceled}, after);
    drop(jobs_.find(id), after);
    throw;
  }
}

void JobTable::has_been_queued(const std::string& id, const Outcome& outcome) {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return;
  Job& job = found->second;
  job.is_settled = true;
  tell(job.writing_waiters, after);
  if (!outcome) return;
  spdlog::info("job {}: it can't be written down, and is refused", id);
  if (!proto::has_ended(job.view.state)) end(job, {JobState::canceled}, after);
  drop(found, after);
}

JobTable::Aftermath::~Aftermath() {
  while (told) std::exchange(told, told->next)->told();
  for (const std::string& job : forgotten) {
    try {
      (*forget)(job);
    } catch (const std::exception& error) {  // The next daemon finds what is left.
      spdlog::error("job {}: {}", job, error.what());
    }
  }
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
  if (found == jobs_.end() || !proto::has_ended(found->second.view.state)) return;
  const JobEvent event = now(found->second, JobEvent::ImageGone{});
  apply(id, event, after);
  if (found->second.is_written) write(id, event, Journal::OnFailure::retry, false);
}

void JobTable::let_go(const std::string& id) noexcept {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return;
  Job& job = found->second;
  if (--job.holds == 0 && !job.kept) finish(job, {JobState::canceled}, after);
}

proto::Result<bool> JobTable::keep(const std::string& id) {
  Told written;
  {
    const std::lock_guard lock(mutex_);
    Job* job = find_unfinished(id);
    if (!job) return false;
    if (std::exchange(job->kept, true) || !journal_) return true;
    // With all that has happened to it, as it would have been written at once.
    const JobView& view = job->view;
    const auto since = [&](const JobTimes::Clock::time_point& time) {
      const auto age = time - view.times.queued;
      return JobEvent{view.times.created + std::chrono::duration_cast<std::chrono::system_clock::duration>(age), age,
                      JobEvent::Preparing{}};
    };
    const auto write_later = [&](JobEvent event, decltype(JobEvent::what) what) {
      event.what = std::move(what);
      write(id, event, Journal::OnFailure::refuse, true);
    };
    written = write_and_tell(id, {view.times.created, {}, JobEvent::Queued{view.order}}, Journal::OnFailure::refuse);
    job->is_written = job->is_settled = true;
    if (view.times.preparing) write_later(since(*view.times.preparing), JobEvent::Preparing{});
    if (view.plan) write_later(since(*view.times.preparing), JobEvent::Planned{view.plan});
    if (view.times.rendering) write_later(since(*view.times.rendering), JobEvent::Rendering{view.structure});
  }
  if (!written.get()) return true;
  const std::lock_guard lock(mutex_);
  if (Job* job = find_unfinished(id)) job->kept = job->is_written = job->is_settled = false;
  return *written.get();
}

bool JobTable::wait(const std::string& id, Waiter& waiter, Until until) {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return false;
  Job& job = found->second;
  const bool is_so_far = until == Until::written ? !job.is_written || job.is_settled
                                                 : proto::has_ended(job.view.state) || job.is_suspended;
  if (is_so_far) return false;
  waiter.next = std::exchange(until == Until::written ? job.writing_waiters : job.waiters, &waiter);
  return true;
}

bool JobTable::stop_waiting(const std::string& id, Waiter& waiter) {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return false;
  for (Waiter** first : {&found->second.waiters, &found->second.writing_waiters})
    for (Waiter** at = first; *at; at = &(*at)->next)
      if (*at == &waiter) {
        *at = waiter.next;
        return true;
      }
  return false;
}

JobTable::Job* JobTable::find_unfinished(const std::string& id) {
  const auto found = jobs_.find(id);
  return found == jobs_.end() || proto::has_ended(found->second.view.state) ? nullptr : &found->second;
}

JobTable::Job* JobTable::find_at_work(const std::string& id) {
  Job* job = find_unfinished(id);
  return job && !job->ending.valid() && !job->is_suspended ? job : nullptr;
}

bool JobTable::is_unfinished(const std::string& id) {
  const std::lock_guard lock(mutex_);
  return find_at_work(id) != nullptr;
}

bool JobTable::start_preparing(const std::string& id) {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  Job* job = find_at_work(id);
  return job && happen(*job, JobEvent::Preparing{}, after);
}

bool JobTable::set_plan(const std::string& id, std::shared_ptr<const PlanReport> plan,
                        std::shared_ptr<const ObjectMarks> tested) {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  Job* job = find_at_work(id);
  if (!job) return false;
  job->view.tested = std::move(tested);
  return happen(*job, JobEvent::Planned{std::move(plan)}, after);
}

bool JobTable::start_rendering(const std::string& id, std::optional<StructureUse> structure,
                               std::shared_ptr<const Film> film) {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  Job* job = find_at_work(id);
  if (!job) return false;
  job->film = std::move(film);
  return happen(*job, JobEvent::Rendering{std::move(structure)}, after);
}

bool JobTable::complete(const std::string& id, std::optional<StructureUse> structure, const KeptImage& image) {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  Job* job = find_at_work(id);
  const bool has_image = image.on_disk || image.for_journal;
  if (job && job->is_written && forget_ && !has_image) return false;
  JobEvent::Ended how{JobState::completed, "", std::move(structure), has_image};
  how.image = image.for_journal;
  return job && finish(*job, std::move(how), after);
}

bool JobTable::fail(const std::string& id, std::string why) {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  Job* job = find_at_work(id);
  if (!job) return false;
  spdlog::error("job {}: {}", id, why);
  return finish(*job, {JobState::failed, std::move(why)}, after);
}

proto::Result<JobView> JobTable::cancel(const std::string& id) {
  Told written;
  bool is_mine = false;
  {
    Aftermath after;
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(id);
    if (found == jobs_.end()) return absent(id);
    is_mine = finish(found->second, {JobState::canceled}, after);
    if (!proto::has_ended(found->second.view.state)) written = found->second.ending;
  }
  const Outcome outcome = written.valid() ? written.get() : std::nullopt;
  if (is_mine && outcome) {
    Problem problem = *outcome;
    problem.detail +=
        " The work on the job has stopped all the same; if the server ends before that can be written, the next start "
        "goes on with it.";
    return problem;
  }
  const auto view = find(id);
  if (is_mine || !view) return view;
  return Problem{ProblemCode::job_already_ended,
                 "The job is " + std::string(proto::name(view->state)) + "; there is nothing to cancel.",
                 {}};
}

std::optional<Problem> JobTable::remove(const std::string& id) {
  Told written;
  {
    Aftermath after;
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(id);
    if (found == jobs_.end()) return absent(id);
    const Job& job = found->second;
    if (!proto::has_ended(job.view.state))
      return Problem{ProblemCode::job_still_active,
                     "The job is " + std::string(proto::name(job.view.state)) + "; cancel it first.",
                     {}};
    const JobEvent event = now(job, JobEvent::Removed{.owner = job.view.order->owner});
    if (!job.is_written) {
      apply(id, event, after);
      announce(id, event, std::nullopt, after);
      return std::nullopt;
    }
    written = write_and_tell(id, event, Journal::OnFailure::refuse, [this, id, event](const Outcome& outcome) {
      if (outcome) return;
      Aftermath its_after;
      const std::lock_guard its_lock(mutex_);
      apply(id, event, its_after);
    });
  }
  return written.get();
}

proto::Result<JobView> JobTable::find(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return absent(id);
  return found->second.view;
}

proto::Result<std::shared_ptr<const Film>> JobTable::film(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return absent(id);
  const Job& job = found->second;
  if (job.film || job.has_image) return job.film;
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

bool JobTable::webhook_tried(const std::string& id, JobEvent::WebhookTried tried) {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return false;
  const JobEvent event = now(found->second, std::move(tried));
  apply(id, event, after);
  if (found->second.is_written) write(id, event, Journal::OnFailure::retry, false);
  return true;
}

bool JobTable::is_written(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  return found != jobs_.end() && found->second.is_written;
}

bool JobTable::goes_on_later(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  return found != jobs_.end() && found->second.is_suspended;
}

void JobTable::lend(const std::shared_ptr<const Film>& film, std::uint64_t bytes) {
  Aftermath after;
  const std::lock_guard lock(mutex_);
  make_room(bytes, after);
  leaving_.emplace_back(film, bytes);
}

bool JobTable::render_again(const std::string& id, std::shared_ptr<const void> needs) {
  {
    Aftermath after;
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(id);
    if (found == jobs_.end() || found->second.view.state != JobState::completed || !found->second.has_image)
      return false;
    if (!found->second.view.order->settings.seconds) {
      found->second.needs = std::move(needs);
      return happen(found->second, JobEvent::QueuedAgain{}, after);
    }
  }
  let_image_go(id);
  return false;
}

JobTable::Retry JobTable::claim(const RetryKey& key) {
  const std::lock_guard lock(mutex_);
  if (const auto known = retries_.find(key.key); known != retries_.end()) {
    const Job& job = jobs_.find(known->second)->second;
    if (job.view.order->retry != key) return {Retry::Is::another_request};
    // Until it is there for good, whoever sent it first may yet be told that it was refused.
    return job.is_settled ? Retry{Retry::Is::known, known->second} : Retry{Retry::Is::in_progress};
  }
  if (!claimed_.insert(key.key).second) return {Retry::Is::in_progress};
  const auto give_back = [this](const std::string* claimed) {
    {
      const std::lock_guard its_lock(mutex_);
      claimed_.erase(*claimed);
    }
    delete claimed;
  };
  return {Retry::Is::first, "", std::shared_ptr<const std::string>(new std::string(key.key), give_back)};
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
  for (auto& [id, job] : jobs_) {
    if (proto::has_ended(job.view.state) || job.ending.valid()) continue;
    if (job.is_written) {
      job.is_suspended = true;
      job.stop.request_stop();
      tell(job.waiters, after);
    } else {
      const JobEvent end = now(job, JobEvent::Ended{JobState::canceled});
      apply_now(id, end, after);
      announce(id, end, std::nullopt, after);
    }
  }
  forget_oldest(after);
  after.audience.add(events_.close());
}

void JobTable::restore(const std::string& id, const JobEvent& event, std::uint64_t seq) {
  if (!is_job_id(id)) throw std::runtime_error("no job is called so");
  Aftermath after;
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  const auto* ended = std::get_if<JobEvent::Ended>(&event.what);
  const bool ends = ended && found != jobs_.end() && !proto::has_ended(found->second.view.state);
  apply(id, event, after);
  if (ends) found->second.view.progress = found->second.progress = std::make_shared<Progress>(ended->figures);
  if (const auto* removed = std::get_if<JobEvent::Removed>(&event.what); removed && removed->expired)
    remember_expired(id);
  announce(id, event, seq, after);
  events_.begin_after(seq);
  if (!std::holds_alternative<JobEvent::Queued>(event.what)) return;
  Job& job = jobs_.find(id)->second;
  job.is_written = job.is_settled = true;
  last_time_ = std::max(last_time_, time_of(id));
}

std::vector<std::string> JobTable::queue_again(
    const std::function<std::shared_ptr<const void>(const JobOrder& order)>& needs) {
  std::vector<std::string> ids;
  Aftermath after;
  const std::lock_guard lock(mutex_);
  for (auto& [id, job] : jobs_) {
    if (proto::has_ended(job.view.state)) continue;
    job.needs = needs(*job.view.order);
    happen(job, JobEvent::QueuedAgain{}, after);
    ids.push_back(id);
  }
  forget_oldest(after);
  return ids;
}

std::optional<JobTable::Admitted> JobTable::take_up(const std::string& id) {
  const std::lock_guard lock(mutex_);
  Job* job = find_at_work(id);
  if (!job) return std::nullopt;
  return admitted(*job);
}

}  // namespace tessera::server
