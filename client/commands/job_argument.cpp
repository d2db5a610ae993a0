#include <CLI/CLI.hpp>

#include "client/commands/commands.h"

namespace tessera::client {

void add_job_argument(CLI::App& command, std::string& id) {
  command.add_option("ID", id, "The job: its id, as much of the beginning as no other's has, or @latest")->required();
}

}  // namespace tessera::client
