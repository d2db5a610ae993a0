#include <iostream>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/commands/follow.h"

namespace tessera::client {

void add_watch(CLI::App& tool, Session& session) {
  CLI::App* command = tool.add_subcommand("watch", "Show a job's progress until it has ended");
  const auto id = std::make_shared<std::string>();
  command->add_option("ID", *id, "The job")->required();
  command->callback([id, &session] {
    const proto::JobStatus job = follow(session, *id);
    if (session.json) std::cout << proto::to_json(job).dump(2) << "\n";
  });
}

}  // namespace tessera::client
