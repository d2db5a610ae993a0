#include <memory>

#include <CLI/CLI.hpp>

#include "client/commands/commands.h"

namespace tessera::client {
namespace {

using Act = void (Client::*)(const std::string& id) const;

void add(CLI::App& tool, Session& session, const char* name, const char* description, Act act) {
  CLI::App* command = tool.add_subcommand(name, description);
  const auto id = std::make_shared<std::string>();
  command->add_option("ID", *id, "The job")->required();
  command->callback([id, act, &session] { (session.client().*act)(*id); });
}

}  // namespace

void add_cancel_and_delete(CLI::App& tool, Session& session) {
  add(tool, session, "cancel", "Stop a job", &Client::cancel);
  add(tool, session, "delete", "Forget an ended job and its image", &Client::remove);
}

}  // namespace tessera::client
