#pragma once

#include <string>

#include "client/commands/commands.h"

namespace tessera::client {

/// Shows a job's progress on stderr until it has ended; under --json on a terminal only. Says there why it failed, and
/// sets the exit code if so. Ctrl-C says how to end the job.
proto::JobStatus follow(Session& session, const std::string& id);

}  // namespace tessera::client
