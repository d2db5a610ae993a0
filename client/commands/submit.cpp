#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"
#include "client/commands/scene_arguments.h"

namespace tessera::client {

void add_submit(CLI::App& tool, Session& session) {
  CLI::App* command = tool.add_subcommand("submit", "Submit a scene and print its job's id");
  const auto scene = std::make_shared<SceneArguments>();
  scene->add_to(*command);
  command->add_option("--webhook", scene->options.webhook,
                      "URL that the server tells the job's end to, where it allows its host");
  command->callback([scene, &session] {
    const proto::JobStatus job = scene->submit(session);
    session.json ? session.print_json(proto::to_json(job)) : session.print(job.id);
  });
}

}  // namespace tessera::client
