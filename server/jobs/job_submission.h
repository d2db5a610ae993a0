#pragma once

#include <chrono>
#include <stop_token>
#include <string>

#include "proto/parse.h"
#include "server/http/principal.h"
#include "server/services.h"

namespace tessera::server {

/// A job that can be rendered.
struct PreparedJob {
  std::string name;
  proto::ParsedScene scene;
  Camera camera;  ///< Placed.
  Settings settings;
  Principal who;                                  ///< That wants it.
  std::chrono::steady_clock::duration parsing{};  ///< How long all of that took.
};

/// Whether a scene is there for `who`: it was posted with one of the owner's keys, or belongs to one of the owner's
/// jobs.
bool may_use_scene(Services& services, const Principal& who, const proto::ContentHash& hash);

/// Brings a job that has been parsed together with its scene, or says why it can't be rendered: a scene that `who` may
/// not use isn't there, say. Throws `Abandoned` once
/// that is requested, and TooHeavy.
proto::Result<PreparedJob> prepare_job(Services& services, proto::JobRequest job, const Principal& who,
                                       const std::stop_token& abandoned);

/// Has it rendered: its id, or why the table doesn't admit it, or the quotas of the key that it came with don't. One
/// that isn't `kept` ends with its last hold
/// (`JobTable::add`).
proto::Result<std::string> start_job(Services& services, const PreparedJob& job, bool kept = true);

}  // namespace tessera::server
