#include <memory>

#include <CLI/CLI.hpp>

#include "client/commands/commands.h"

namespace tessera::client {
namespace {

using Act = void (Client::*)(const std::string& id) const;

void add(CLI::App& tool, Session& session, const char* name, const char* description, Act act) {
  CLI::App* command = tool.add_subcommand(name, description);
  const auto id = std::make_shared<std::string>();
  add_job_argument(*command, *id);
  command->callback([id, act, &session] {
    const Client client = session.client();
    (client.*act)(client.find_job(*id));
  });
}

}  // namespace

void add_cancel_and_delete(CLI::App& tool, Session& session) {
  add(tool, session, "cancel", "Stop a job", &Client::cancel);
  add(tool, session, "delete", "Forget an ended job and its image", &Client::remove);
}

}  // namespace tessera::client
