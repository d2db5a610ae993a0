#include <algorithm>
#include <array>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "server/handlers/handlers.h"
#include "server/handlers/own.h"
#include "server/http/key_ring.h"
#include "server/http/session.h"
#include "server/http/stream.h"
#include "server/jobs/job_table.h"
#include "server/rfc3339.h"

/// Server-sent events (https://html.spec.whatwg.org/multipage/server-sent-events.html).
namespace tessera::server {
namespace {

using nlohmann::json;
using Clock = Stream::Clock;

/// In milliseconds: when a client comes again that has lost the connection.
constexpr const char* kRetry = "retry: 2000\n";
constexpr std::string_view kComment = ":\n\n";
constexpr std::chrono::seconds kKeysAreLookedAt{15};
constexpr std::chrono::milliseconds kBetweenProgress{500};
/// Of all jobs:
constexpr std::chrono::milliseconds kBetweenLooks{100}, kBetweenProgressOfAll{1000};
constexpr std::size_t kMostEvents = 64, kMostInProgress = 32;

std::string event_text(std::string_view name, const json& data, std::optional<EventId> id = std::nullopt) {
  std::string text = id ? "id: " + text_of(*id) + '\n' : "";
  text += "event: ";
  text += name;
  text += "\ndata: " + data.dump(-1, ' ', false, json::error_handler_t::replace) + "\n\n";
  return text;
}

/// When a job has come to a step; nothing when it hasn't, as it is queued once more.
std::optional<Clock::time_point> time_of(const JobTimes& times, JobStep step) {
  switch (step) {
    case JobStep::queued:
      return times.queued;
    case JobStep::preparing:
      return times.preparing;
    case JobStep::rendering:
      return times.rendering;
    case JobStep::ended:
      break;
  }
  return times.ended;
}

proto::JobState state_of(const JobView& job, JobStep step) {
  return step == JobStep::ended ? job.state : static_cast<proto::JobState>(step);
}

/// A job has come to a step; empty where it has begun anew since.
std::string state_event(const JobView& job, JobStep step, EventId id) {
  const auto reached = time_of(job.times, step);
  if (!reached) return "";
  const auto age = std::chrono::duration_cast<std::chrono::system_clock::duration>(*reached - job.times.queued);
  json data{{"job", job.id},
            {"name", job.order->name},
            {"state", proto::name(state_of(job, step))},
            {"time", rfc3339(job.times.created + age)}};
  if (step == JobStep::ended) {
    data["status"] = to_json(status_of(job, *reached));
    if (job.image == proto::ImageState::complete) data["image"] = "/v1/jobs/" + job.id + "/image";
  }
  return event_text("state", data, id);
}

/// A job isn't there any more.
std::string removed_event(const EventFeed::Event& event) {
  return event_text("removed", {{"job", event.job}, {"reason", event.expired ? "expired" : "deleted"}}, event.id);
}

std::string progress_event(const JobView& job, Clock::time_point now) {
  return event_text("progress", to_json(status_of(job, now)));
}

std::string pass_event(const JobView& job, Clock::time_point now) {
  const json status = to_json(status_of(job, now));
  json data{{"job", job.id},
            {"passes", status["passes"]},
            {"samples_per_pixel", status["samples_per_pixel"]},
            {"image", "/v1/jobs/" + job.id + "/image?partial=1"}};
  if (status.contains("achieved")) data["achieved"] = status["achieved"];
  return event_text("pass", data);
}

/// Tiles have all of their samples: the last of them, as x, y, width and height, and how many there are by now.
std::string tiles_event(const JobView& job, const std::vector<PixelRect>& tiles, std::uint64_t all) {
  json rects = json::array();
  for (const PixelRect& rect : tiles) rects.push_back({rect.x0, rect.y0, rect.width(), rect.height()});
  return event_text("tiles", {{"job", job.id},
                              {"tiles", std::move(rects)},
                              {"tiles_done", all},
                              {"image", "/v1/jobs/" + job.id + "/image?partial=1"}});
}

/// Who watches, for as long as the key is good that was shown at the beginning.
class Witness {
 public:
  Witness(Services& services, const Request& request)
      : services_(services),
        who_(request.who),
        authorization_(request.header("authorization").value_or("")),
        looked_(Clock::now()) {}

  /// Whose jobs are to be seen; nothing: everybody's.
  std::optional<std::string> owner() const {
    return who_.may(proto::Scope::admin) ? std::nullopt : std::optional(who_.owner);
  }

  bool may_still_see(Clock::time_point now) {
    if (now - looked_ < kKeysAreLookedAt) return true;
    looked_ = now;
    const auto found =
        services_.keys.find(authorization_.empty() ? std::nullopt : std::optional<std::string_view>(authorization_));
    return found && found->may(proto::Scope::read) && found->owner == who_.owner;
  }

 private:
  Services& services_;
  const Principal who_;
  const std::string authorization_;
  Clock::time_point looked_;
};

/// What happens to one job. All that a watcher has to remember is what it was told last.
class JobEvents final : public Stream {
 public:
  JobEvents(Services& services, const Request& request, EventId told)
      : jobs_(services.jobs), witness_(services, request), job_(request.parameter), told_(told) {}

  Piece next(Clock::time_point now) override {
    Piece piece{std::exchange(greeting_, ""), false, Clock::time_point::max()};
    const EventFeed::Steps steps = jobs_.events().steps_of(job_);
    const auto job = jobs_.find(job_);
    if (!job || !witness_.may_still_see(now)) {
      piece.is_last = true;
      return piece;
    }
    for (std::size_t i = 0; i < kJobSteps; ++i) {
      if (!steps[i] || *steps[i] <= told_) continue;
      piece.text += state_event(*job, static_cast<JobStep>(i), *steps[i]);
      told_ = *steps[i];
    }
    if (steps[static_cast<std::size_t>(JobStep::ended)] && proto::has_ended(job->state)) {
      piece.is_last = true;
    } else if (steps[static_cast<std::size_t>(JobStep::rendering)] && job->state == proto::JobState::rendering) {
      add_progress(piece, *job, now);
    }
    return piece;
  }

  std::string_view filler() const override { return kComment; }
  Clock::duration rest() const override { return Clock::duration::zero(); }
  bool watch(EventFeed::Watcher& watcher) noexcept override { return jobs_.events().watch(job_, watcher); }
  bool stop_watching(EventFeed::Watcher& watcher) noexcept override {
    return jobs_.events().stop_watching(job_, watcher);
  }

 private:
  void add_progress(Piece& piece, const JobView& job, Clock::time_point now) {
    if (now >= next_progress_) {
      next_progress_ = now + kBetweenProgress;
      const std::uint32_t passes = job.progress->passes().passes;
      const std::uint64_t samples = job.progress->samples();
      if (const auto recent = job.progress->recent_tiles(tiles_told_); !recent.empty())
        piece.text += tiles_event(job, recent, tiles_told_);
      if (passes > passes_told_) piece.text += pass_event(job, now);
      if (samples != samples_told_) piece.text += progress_event(job, now);
      passes_told_ = passes;
      samples_told_ = samples;
    }
    piece.next = next_progress_;
  }

  JobTable& jobs_;
  Witness witness_;
  const std::string job_;
  std::string greeting_ = std::string(kRetry) + '\n';
  EventId told_;
  std::uint32_t passes_told_ = 0;
  std::uint64_t samples_told_ = 0, tiles_told_ = 0;
  Clock::time_point next_progress_;
};

/// What happens to all jobs of somebody.
class AllEvents final : public Stream {
 public:
  AllEvents(Services& services, const Request& request, EventId told)
      : jobs_(services.jobs),
        witness_(services, request),
        greeting_(kRetry + ("id: " + text_of(told)) + "\n\n"),
        told_(told) {}

  Piece next(Clock::time_point now) override {
    Piece piece{std::exchange(greeting_, ""), false, now + kBetweenProgressOfAll};
    if (!witness_.may_still_see(now)) {
      piece.is_last = true;
      return piece;
    }
    const EventId before = told_;
    for (const EventFeed::Event& event : jobs_.events().after(told_, kMostEvents, witness_.owner())) {
      if (!event.step)
        piece.text += removed_event(event);
      else if (const auto job = jobs_.find(event.job))
        piece.text += state_event(*job, *event.step, event.id);
    }
    if (told_ != before) piece.next = now;  // There may be more.
    if (now >= next_progress_) {
      next_progress_ = now + kBetweenProgressOfAll;
      add_progress(piece, now);
    }
    return piece;
  }

  std::string_view filler() const override { return kComment; }
  Clock::duration rest() const override { return kBetweenLooks; }
  bool watch(EventFeed::Watcher& watcher) noexcept override { return jobs_.events().watch(std::nullopt, watcher); }
  bool stop_watching(EventFeed::Watcher& watcher) noexcept override {
    return jobs_.events().stop_watching(std::nullopt, watcher);
  }

 private:
  /// Of some jobs, others each time.
  void add_progress(Piece& piece, Clock::time_point now) {
    const auto rendering = jobs_.events().rendering(behind_, kMostInProgress, witness_.owner());
    behind_ = rendering.size() < kMostInProgress ? "" : rendering.back();
    std::map<std::string, std::uint64_t> told;
    for (const std::string& id : rendering) {
      const auto job = jobs_.find(id);
      if (!job || job->state != proto::JobState::rendering) continue;
      const std::uint64_t samples = told[id] = job->progress->samples();
      if (const auto before = samples_told_.find(id); before == samples_told_.end() || before->second != samples)
        piece.text += progress_event(*job, now);
    }
    samples_told_ = std::move(told);
  }

  JobTable& jobs_;
  Witness witness_;
  std::string greeting_;
  EventId told_;
  std::string behind_;                                 ///< The last job whose progress was told in the last round.
  std::map<std::string, std::uint64_t> samples_told_;  ///< In that round.
  Clock::time_point next_progress_;
};

/// What the client has been told before; nothing where it says nothing that can be so.
std::optional<EventId> told_before(const EventFeed& feed, const Request& request) {
  const auto id = read_event_id(request.header("last-event-id").value_or(""));
  return id && *id <= feed.last() ? id : std::nullopt;
}

/// Streams stay for as long as they like, and others have to get in beside them.
std::optional<proto::Problem> refuse_watcher(const Services& services) {
  const Connections* const connections = services.connections;
  if (!connections || connections->streams < std::max(services.most_connections / 2, 1u)) return std::nullopt;
  return proto::Problem{proto::ProblemCode::out_of_memory_budget,
                        "Half of the connections that there may be watch jobs already (--max-connections).",
                        {}};
}

Response event_stream(std::shared_ptr<Stream> stream) {
  Response response{200, {{"Content-Type", "text/event-stream"}, {"Cache-Control", "no-store"}}, ""};
  response.headers.emplace_back("X-Accel-Buffering", "no");  // Of nginx, which gathers answers otherwise.
  response.stream = std::move(stream);
  return response;
}

}  // namespace

Response watch_job(Services& services, Request& request) {
  const auto job = find_job(services, request);
  if (!job) return problem_response(job.problem());
  const EventFeed& feed = services.jobs.events();
  const EventId told = told_before(feed, request).value_or(EventId{});
  const auto end = feed.steps_of(job->id)[static_cast<std::size_t>(JobStep::ended)];
  if (end && *end <= told) return {204, {}, ""};  // So that the client doesn't come again.
  if (const auto problem = refuse_watcher(services)) return problem_response(*problem);
  return event_stream(std::make_shared<JobEvents>(services, request, told));
}

Response watch_jobs(Services& services, Request& request) {
  if (const auto problem = refuse_watcher(services)) return problem_response(*problem);
  const EventFeed& feed = services.jobs.events();
  return event_stream(std::make_shared<AllEvents>(services, request, told_before(feed, request).value_or(feed.last())));
}

}  // namespace tessera::server
