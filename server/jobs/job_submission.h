#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "core/film/film.h"
#include "proto/parse.h"
#include "server/http/principal.h"
#include "server/jobs/job.h"
#include "server/jobs/job_table.h"
#include "server/services.h"

namespace tessera::server {

class ImageStore;
class Journal;
class SceneStore;

/// A job that can be rendered.
struct PreparedJob {
  std::string name;
  proto::ParsedScene scene;
  Camera camera;  ///< Placed.
  Settings settings;
  Principal who;                                  ///< That wants it.
  std::chrono::steady_clock::duration parsing{};  ///< How long all of that took.
  std::string document;                           ///< `JobOrder::document`, where the job may be kept.
  std::optional<RetryKey> retry = {};
  proto::Priority priority = proto::Priority::normal;
  std::string webhook = {};
};

/// Whether a scene is there for `who`: it was posted with one of the owner's keys, or belongs to one of the owner's
/// jobs.
bool may_use_scene(Services& services, const Principal& who, const proto::ContentHash& hash);

/// Brings a job that has been parsed together with its scene, or says why it can't be rendered: a scene that `who` may
/// not use isn't there, say. `document` is what it was parsed from; only jobs that are never kept need none. Throws
/// `Abandoned` once that is requested, and TooHeavy.
proto::Result<PreparedJob> prepare_job(Services& services, proto::JobRequest job, std::string_view document,
                                       const Principal& who, const std::stop_token& abandoned);

/// Has the scene of a job that is going to be kept be there whenever it is rendered: `document` is the job's as it was
/// sent. The problem, when that can't be. Throws like `prepare_job`.
std::optional<proto::Problem> keep_scene(Services& services, const PreparedJob& job, std::string_view document,
                                         const std::stop_token& abandoned);

/// Has it rendered, or says why the table doesn't admit it, or the quotas of the key that it came with don't. One that
/// isn't `kept` ends with its last hold, and one that is may be refused yet (`JobTable::add`).
proto::Result<JobTable::Admitted> start_job(Services& services, const PreparedJob& job, bool kept = true);

/// Has the table know the jobs of earlier daemons: the ids of those that hadn't ended, in the order in which they came.
/// Entries that can't be read are logged. Jobs whose images are gone from the disk haven't ended.
std::vector<std::string> restore_jobs(const Journal& journal, const ImageStore& films, SceneStore& scenes,
                                      JobTable& jobs);

/// A job that the table has, as it was prepared when it came. Throws as `prepare_job` does.
proto::Result<PreparedJob> prepare_again(Services& services, const JobOrder& order, const std::stop_token& stop);

/// What there is of a job's image, wherever it lies (`JobTable::film`); in the quick lane TooHeavy when that is the
/// disk. One that is damaged there is rendered again: `image_not_ready`.
proto::Result<std::shared_ptr<const Film>> find_film(Services& services, const std::string& id);

}  // namespace tessera::server
