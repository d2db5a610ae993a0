#pragma once

#include <chrono>
#include <stop_token>
#include <string>

#include "proto/parse.h"
#include "server/services.h"

namespace tessera::server {

/// A job that can be rendered.
struct PreparedJob {
  std::string name;
  proto::ParsedScene scene;
  Camera camera;  ///< Placed.
  Settings settings;
  std::chrono::steady_clock::duration parsing{};  ///< How long all of that took.
};

/// Brings a job that has been parsed together with its scene, or says why it can't be rendered. Throws `Abandoned` once
/// that is requested, and TooHeavy.
proto::Result<PreparedJob> prepare_job(Services& services, proto::JobRequest job, const std::stop_token& abandoned);

/// Has it rendered: its id, or why the table doesn't admit it. One that isn't `kept` ends with its last hold
/// (`JobTable::add`).
proto::Result<std::string> start_job(Services& services, const PreparedJob& job, bool kept = true);

}  // namespace tessera::server
