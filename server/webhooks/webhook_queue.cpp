#include "server/webhooks/webhook_queue.h"

#include <algorithm>
#include <new>
#include <utility>

namespace tessera::server {

void WebhookQueue::add(const std::string& job, const std::string& lane, Time due) {
  if (jobs_.contains(job)) return;
  Jobs entry{{due, job}};
  const auto at = lanes_.try_emplace(lane).first;
  try {
    jobs_.emplace(job, Place{lane, due});
  } catch (const std::bad_alloc&) {
    remove_if_empty(at);
    throw;
  }
  at->second.waiting.merge(entry);
}

void WebhookQueue::remove_if_empty(Lanes::iterator lane) {
  if (lane->second.on_their_way.empty() && lane->second.waiting.empty()) lanes_.erase(lane);
}

void WebhookQueue::remove(const std::string& job) {
  const auto known = jobs_.find(job);
  if (known == jobs_.end()) return;
  const auto lane = lanes_.find(known->second.lane);
  if (lane->second.waiting.erase({known->second.due, job}) == 0) return;
  jobs_.erase(known);
  remove_if_empty(lane);
}

const std::string* WebhookQueue::take(Time now) {
  Lane* best = nullptr;
  const auto rank = [](const Lane& lane) { return std::pair(lane.on_their_way.size(), lane.waiting.begin()->first); };
  for (auto& [name, lane] : lanes_) {
    if (lane.waiting.empty() || lane.waiting.begin()->first > now || lane.on_their_way.size() >= most_of_lane_)
      continue;
    if (!best || rank(lane) < rank(*best)) best = &lane;
  }
  if (!best) return nullptr;
  return &best->on_their_way.insert(best->waiting.extract(best->waiting.begin())).position->second;
}

WebhookQueue::Jobs::node_type WebhookQueue::take_back(Lane& lane, const std::string& job) {
  return lane.on_their_way.extract(std::ranges::find(lane.on_their_way, job, &Jobs::value_type::second));
}

void WebhookQueue::put_back(const std::string& job, Time due) {
  Place& place = jobs_.find(job)->second;
  Lane& lane = lanes_.find(place.lane)->second;
  place.due = due;
  auto node = take_back(lane, job);
  node.value().first = due;
  lane.waiting.insert(std::move(node));
}

void WebhookQueue::done(const std::string& job) {
  const auto known = jobs_.find(job);
  const auto lane = lanes_.find(known->second.lane);
  take_back(lane->second, job);
  jobs_.erase(known);
  remove_if_empty(lane);
}

std::optional<WebhookQueue::Time> WebhookQueue::next() const {
  std::optional<Time> earliest;
  for (const auto& [name, lane] : lanes_)
    if (!lane.waiting.empty() && lane.on_their_way.size() < most_of_lane_)
      earliest = std::min(earliest.value_or(Time::max()), lane.waiting.begin()->first);
  return earliest;
}

std::size_t WebhookQueue::due(Time now) const {
  std::size_t count = 0;
  for (const auto& [name, lane] : lanes_)
    count += lane.on_their_way.size() + static_cast<std::size_t>(std::ranges::count_if(
                                            lane.waiting, [&](const auto& job) { return job.first <= now; }));
  return count;
}

}  // namespace tessera::server
