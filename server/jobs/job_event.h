#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "proto/parse.h"
#include "server/jobs/event_feed.h"
#include "server/jobs/job.h"
#include "server/store/journal.h"

namespace tessera::server {

/// Something that happens to a job. What a job is, follows from its events alone (`JobTable`): the journal has them,
/// and a daemon that starts goes through them again.
struct JobEvent {
  struct Queued {
    std::shared_ptr<const JobOrder> order;
  };
  /// Its work has to be done, or to be gone on with: a daemon has started, or a finished image turned out to be
  /// damaged.
  struct QueuedAgain {};
  struct Preparing {};
  struct Planned {
    std::shared_ptr<const PlanReport> plan;
  };
  struct Rendering {
    std::optional<StructureUse> structure;
  };
  struct Ended {
    proto::JobState state;
    std::string error = {};                      ///< Of a job that has failed.
    std::optional<StructureUse> structure = {};  ///< As it was at the end.
    bool has_image = false;                      ///< On disk.
    JobFigures figures = {};
    std::shared_ptr<const ObjectMarks> tested = {};  ///< What is written of it is how many objects never were:
    std::uint64_t never_tested = 0;                  ///< this, where it is read.
    std::shared_ptr<const std::string> image = {};   ///< Where it is written beside the event.
  };
  /// The image of a job that has ended has been given up, on disk as well.
  struct ImageGone {};
  /// It was tried to deliver the webhook of a job that has ended.
  struct WebhookTried {
    proto::WebhookState state;
    std::string error = {};                          ///< Why it failed.
    std::chrono::steady_clock::duration delay = {};  ///< Until it is tried again.
  };
  /// It was deleted, or has `expired`.
  struct Removed {
    bool expired = false;
    std::string owner = {};  ///< Whose it was: nothing else of the job is kept.
  };

  std::chrono::system_clock::time_point time;
  /// Since the job was queued. Clocks of the system are set back now and then.
  std::chrono::steady_clock::duration age{};
  std::variant<Queued, QueuedAgain, Preparing, Planned, Rendering, Ended, ImageGone, WebhookTried, Removed> what;
};

std::string text_of(const JobFigures& figures);
JobFigures read_figures(const std::string& text);

/// As the journal has them. "queued" again after a start has no order.
std::string_view kind_of(const JobEvent& event);
std::string body_of(const JobEvent& event);

/// The step that a job comes to by an event; nothing where it doesn't come to any.
std::optional<JobStep> step_of(const JobEvent& event);

/// A `JobOrder::document`, whatever limits there are now: it was accepted within those of its day.
proto::Result<proto::JobRequest> read_order_document(std::string_view document);

/// Throws std::exception for what no event is written as.
JobEvent read_event(const JournalEntry& entry);

}  // namespace tessera::server
