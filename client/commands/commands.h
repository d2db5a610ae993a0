#pragma once

#include <string>

#include "client/client.h"

namespace CLI {
class App;
}

namespace tessera::client {

/// How the tool ends; scripts rely on these.
enum class ExitCode {
  ok = 0,
  job_did_not_complete = 1,
  usage = 2,
  refused = 3,
  unreachable = 4,
  local_file = 5,
};

/// What every command knows: the options given before or after its name, and how it went.
struct Session {
  std::string server_url = "http://127.0.0.1:8080";
  bool json = false;  ///< Answers on stdout are for programs.
  ExitCode exit_code = ExitCode::ok;

  Client client() const;
};

// Each adds its commands to the tool; the commands run while the command line is parsed, and throw `Failure`.
void add_render(CLI::App& tool, Session& session);
void add_submit(CLI::App& tool, Session& session);
void add_watch(CLI::App& tool, Session& session);
void add_fetch(CLI::App& tool, Session& session);
void add_list(CLI::App& tool, Session& session);
void add_cancel_and_delete(CLI::App& tool, Session& session);
void add_plan_and_stats(CLI::App& tool, Session& session);
void add_capabilities(CLI::App& tool, Session& session);

}  // namespace tessera::client
