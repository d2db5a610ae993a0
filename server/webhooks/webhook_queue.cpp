#include "server/webhooks/webhook_queue.h"

#include <algorithm>
#include <utility>

namespace tessera::server {

void WebhookQueue::add(const std::string& job, const std::string& lane, Time due) {
  if (!lane_of_.emplace(job, lane).second) return;
  lanes_[lane].waiting.emplace(due, job);
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
  Lane& lane = lanes_.find(lane_of_.find(job)->second)->second;
  auto node = take_back(lane, job);
  node.value().first = due;
  lane.waiting.insert(std::move(node));
}

void WebhookQueue::done(const std::string& job) {
  const auto known = lane_of_.find(job);
  const auto lane = lanes_.find(known->second);
  lane_of_.erase(known);
  take_back(lane->second, job);
  if (lane->second.on_their_way.empty() && lane->second.waiting.empty()) lanes_.erase(lane);
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
