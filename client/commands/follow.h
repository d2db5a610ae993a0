#pragma once

#include <string>

#include "client/commands/commands.h"

namespace tessera::client {

/// Shows a job's progress on stderr until it has ended. Says there why it failed, and sets the exit code if so.
proto::JobStatus follow(Session& session, const std::string& id);

}  // namespace tessera::client
