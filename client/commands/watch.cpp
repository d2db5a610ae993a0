#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/commands/follow.h"

namespace tessera::client {

void add_watch(CLI::App& tool, Session& session) {
  CLI::App* command = tool.add_subcommand("watch", "Show a job's progress until it has ended");
  const auto id = std::make_shared<std::string>();
  add_job_argument(*command, *id);
  command->callback([id, &session] {
    const proto::JobStatus job = follow(session, session.client().find_job(*id));
    if (session.json) session.print_json(proto::to_json(job));
  });
}

}  // namespace tessera::client
