#include "server/jobs/event_feed.h"

#include <algorithm>
#include <charconv>
#include <new>
#include <system_error>
#include <utility>

namespace tessera::server {
namespace {

/// Under the lock.
constexpr std::size_t kMostLookedAt = 1000;

constexpr std::size_t kMostRemovals = 10'000;

std::size_t index_of(JobStep step) { return static_cast<std::size_t>(step); }

/// Whether all of the text is a number.
bool read_number(std::string_view text, std::uint64_t& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

std::string text_of(EventId id) { return std::to_string(id.seq) + (id.sub == 0 ? "" : '.' + std::to_string(id.sub)); }

std::optional<EventId> read_event_id(std::string_view text) {
  EventId id;
  const std::size_t point = text.find('.');
  if (!read_number(text.substr(0, point), id.seq)) return std::nullopt;
  if (point != std::string_view::npos && !read_number(text.substr(point + 1), id.sub)) return std::nullopt;
  return id;
}

EventFeed::Audience::~Audience() {
  while (first_) std::exchange(first_, first_->next)->told();
}

void EventFeed::Audience::add(Audience&& others) noexcept {
  while (others.first_) {
    Watcher& watcher = *std::exchange(others.first_, others.first_->next);
    watcher.next = std::exchange(first_, &watcher);
  }
}

void EventFeed::add(const std::string& job, const std::string& owner) {
  Job entry{owner, {}, {}, {}, nullptr};
  for (Order::node_type& node : entry.spare) {
    Order order;
    node = order.extract(order.try_emplace(EventId{}, Told{nullptr, nullptr, JobStep::queued}).first);
  }
  Rendering rendering;
  entry.spare_rendering = rendering.extract(rendering.try_emplace(job, nullptr).first);
  const std::lock_guard lock(mutex_);
  jobs_.try_emplace(job, std::move(entry));
}

EventId EventFeed::next_id(std::optional<std::uint64_t> seq) noexcept {
  const EventId id = seq ? EventId{*seq, 0} : EventId{last_.seq, last_.sub + 1};
  last_ = std::max(last_, id);
  return id;
}

void EventFeed::take_back(Job& job, JobStep step) noexcept {
  auto& id = job.steps[index_of(step)];
  if (!id) return;
  job.spare[index_of(step)] = order_.extract(*id);
  id.reset();
}

void EventFeed::stop_rendering(const std::string& name, Job& job) noexcept {
  if (!job.spare_rendering) job.spare_rendering = rendering_.extract(name);
}

EventFeed::Audience EventFeed::happened(const std::string& job, JobStep step,
                                        std::optional<std::uint64_t> seq) noexcept {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(job);
  if (found == jobs_.end()) return {};
  const auto& [name, unused] = *found;
  Job& entry = found->second;
  for (std::size_t later = index_of(step); later < kJobSteps; ++later) take_back(entry, static_cast<JobStep>(later));
  stop_rendering(name, entry);

  const EventId id = next_id(seq);
  entry.steps[index_of(step)] = id;
  Order::node_type& node = entry.spare[index_of(step)];
  node.key() = id;
  node.mapped() = {&name, &entry, step};
  order_.insert(std::move(node));
  if (step == JobStep::rendering) {
    entry.spare_rendering.mapped() = &entry;
    rendering_.insert(std::move(entry.spare_rendering));
  }
  Audience audience(std::exchange(entry.watchers, nullptr));
  audience.add(Audience(std::exchange(watchers_, nullptr)));
  return audience;
}

void EventFeed::begin_after(std::uint64_t seq) {
  const std::lock_guard lock(mutex_);
  last_ = std::max(last_, EventId{seq, 0});
}

EventFeed::Audience EventFeed::forget(const std::string& job) noexcept {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(job);
  if (found == jobs_.end()) return {};
  Audience audience(std::exchange(found->second.watchers, nullptr));
  for (std::size_t step = 0; step < kJobSteps; ++step) take_back(found->second, static_cast<JobStep>(step));
  stop_rendering(found->first, found->second);
  jobs_.erase(found);
  return audience;
}

EventFeed::Audience EventFeed::removed(const std::string& job, const std::string& owner, bool expired,
                                       std::optional<std::uint64_t> seq) noexcept {
  const std::lock_guard lock(mutex_);
  try {
    removals_.try_emplace(next_id(seq), Removal{job, owner, expired});
    if (removals_.size() > kMostRemovals) removals_.erase(removals_.begin());
  } catch (const std::bad_alloc&) {  // Then whoever asks for the job finds out.
  }
  return Audience(std::exchange(watchers_, nullptr));
}

EventFeed::Audience EventFeed::close() noexcept {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  Audience audience(std::exchange(watchers_, nullptr));
  for (auto& [name, job] : jobs_) audience.add(Audience(std::exchange(job.watchers, nullptr)));
  return audience;
}

EventId EventFeed::last() const {
  const std::lock_guard lock(mutex_);
  return last_;
}

EventFeed::Steps EventFeed::steps_of(const std::string& job) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(job);
  return found == jobs_.end() ? Steps() : found->second.steps;
}

std::vector<EventFeed::Event> EventFeed::after(EventId& last, std::size_t limit,
                                               const std::optional<std::string>& owner) const {
  std::vector<Event> events;
  const std::lock_guard lock(mutex_);
  auto step = order_.upper_bound(last);
  auto removal = removals_.upper_bound(last);
  for (std::size_t looked_at = 0; events.size() < limit && looked_at < kMostLookedAt; ++looked_at) {
    const bool is_step = step != order_.end() && (removal == removals_.end() || step->first < removal->first);
    if (is_step) {
      const auto& [id, told] = *step++;
      if (!owner || told.entry->owner == *owner) events.push_back({id, *told.job, told.step});
      last = id;
    } else if (removal != removals_.end()) {
      const auto& [id, gone] = *removal++;
      if (!owner || gone.owner == *owner) events.push_back({id, gone.job, std::nullopt, gone.expired});
      last = id;
    } else {
      break;
    }
  }
  return events;
}

std::vector<std::string> EventFeed::rendering(std::string_view after, std::size_t limit,
                                              const std::optional<std::string>& owner) const {
  std::vector<std::string> jobs;
  const std::lock_guard lock(mutex_);
  for (auto at = rendering_.upper_bound(after); at != rendering_.end() && jobs.size() < limit; ++at)
    if (!owner || at->second->owner == *owner) jobs.push_back(at->first);
  return jobs;
}

EventFeed::Watcher** EventFeed::list_of(const std::optional<std::string>& job) noexcept {
  if (!job) return &watchers_;
  const auto found = jobs_.find(*job);
  return found == jobs_.end() ? nullptr : &found->second.watchers;
}

bool EventFeed::watch(const std::optional<std::string>& job, Watcher& watcher) noexcept {
  const std::lock_guard lock(mutex_);
  Watcher** const list = closed_ ? nullptr : list_of(job);
  if (!list) return false;
  watcher.next = std::exchange(*list, &watcher);
  return true;
}

bool EventFeed::stop_watching(const std::optional<std::string>& job, Watcher& watcher) noexcept {
  const std::lock_guard lock(mutex_);
  Watcher** at = list_of(job);
  for (; at && *at; at = &(*at)->next)
    if (*at == &watcher) {
      *at = watcher.next;
      return true;
    }
  return false;
}

}  // namespace tessera::server
