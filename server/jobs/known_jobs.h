#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "proto/wire/result.h"
#include "server/handlers/asset.h"
#include "server/handlers/job_draft.h"
#include "server/jobs/job_submission.h"
#include "server/jobs/job_table.h"
#include "server/services.h"
#include "server/store/single_flight.h"

namespace tessera::server {

/// A job, held for who asked for it.
struct HeldJob {
  std::string id;
  std::shared_ptr<const JobTable::Hold> hold;
};

/// Jobs by the hash of all that their images depend on, so that what is asked for again is rendered once. All who asked
/// while one was made ready hold it together; it is kept without a hold.
class KnownJobs : public SingleFlight<proto::Result<HeldJob>> {
 public:
  KnownJobs() : SingleFlight(kMostBytes) {}

 private:
  static constexpr std::uint64_t kMostBytes = 16 << 20;
};

using PrepareJob = std::function<proto::Result<PreparedJob>(const std::stop_token& unwanted)>;

/// The job that was started under this key before for the same owner, unless that failed, was canceled, or `is_of_use`
/// says no; otherwise one is started now, which ends with its last hold and is found again where it `is_kept_known`.
/// Refused as `prepare` and `start_job` refuse. Throws `Abandoned` once that is requested, and TooHeavy.
proto::Result<HeldJob> find_or_start(Services& services, const std::string& key, bool is_kept_known,
                                     const PrepareJob& prepare, const Principal& who,
                                     const std::function<bool(const JobView&)>& is_of_use,
                                     const std::stop_token& abandoned);

/// The same of what a draft becomes. Refused as POST /v1/jobs refuses, but in terms of what was sent.
proto::Result<HeldJob> find_or_start(Services& services, const Asset& asset, const JobDraft& draft,
                                     const Principal& who, const std::function<bool(const JobView&)>& is_of_use,
                                     const std::stop_token& abandoned);

/// Keeps a job that was started for a draft (`JobTable::keep`), with all that it takes to do it again.
proto::Result<bool> keep_job(Services& services, const Asset& asset, const JobDraft& draft, const JobView& job,
                             const std::stop_token& abandoned);

}  // namespace tessera::server
