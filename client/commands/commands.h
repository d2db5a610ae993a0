#pragma once

#include <string>

#include "client/commands/session.h"

namespace CLI {
class App;
}

namespace tessera::client {

// Each adds its commands to the tool; the commands run while the command line is parsed, and throw `Failure`.
void add_render(CLI::App& tool, Session& session);
void add_submit(CLI::App& tool, Session& session);
void add_watch(CLI::App& tool, Session& session);
void add_fetch(CLI::App& tool, Session& session);
void add_list(CLI::App& tool, Session& session);
void add_cancel_and_delete(CLI::App& tool, Session& session);
void add_plan_and_stats(CLI::App& tool, Session& session);
void add_capabilities(CLI::App& tool, Session& session);
void add_keys(CLI::App& tool, Session& session);
void add_doctor(CLI::App& tool, Session& session);

/// Adds ID, the job that a command is about, as `Client::find_job` takes it.
void add_job_argument(CLI::App& command, std::string& id);

}  // namespace tessera::client
