#include <iostream>

#include <CLI/CLI.hpp>

#include "client/commands/commands.h"
#include "client/failure.h"

namespace tessera::client {

Client Session::client() const {
  const auto address = parse_server_url(server_url);
  if (!address) throw CLI::ValidationError("--server", "'" + server_url + "' isn't a URL like http://127.0.0.1:8080");
  return Client(*address);
}

namespace {

constexpr const char* kExitCodes =
    "Exit codes:\n"
    "  0  all went well\n"
    "  1  the job failed or was canceled\n"
    "  2  the command line is wrong\n"
    "  3  the server refused; what is wrong stands on stderr, a line for each place\n"
    "  4  the server can't be reached\n"
    "  5  a local file can't be read or written\n";

ExitCode exit_code(Failure::Kind kind) {
  switch (kind) {
    case Failure::Kind::refused:
      return ExitCode::refused;
    case Failure::Kind::unreachable:
      return ExitCode::unreachable;
    case Failure::Kind::local_file:
      return ExitCode::local_file;
  }
  return ExitCode::refused;
}

ExitCode run(int argc, char** argv) {
  CLI::App tool("Renders scenes on a Tessera server.", "tessera");
  tool.footer(kExitCodes);
  tool.require_subcommand(1);
  tool.fallthrough();
  tool.set_version_flag("--version", TESSERA_VERSION);

  Session session;
  tool.add_option("--server", session.server_url, "The server's URL")->envname("TESSERA_SERVER")->capture_default_str();
  tool.add_flag("--json", session.json, "Answers on stdout are JSON");
  add_render(tool, session);
  add_submit(tool, session);
  add_watch(tool, session);
  add_fetch(tool, session);
  add_list(tool, session);
  add_cancel_and_delete(tool, session);
  add_plan_and_stats(tool, session);
  add_capabilities(tool, session);

  try {
    tool.parse(argc, argv);
    return session.exit_code;
  } catch (const CLI::ParseError& e) {
    if (const auto left = tool.remaining(); tool.get_subcommands().empty() && !left.empty()) {
      std::cerr << "tessera: there is no command '" << left.front() << "'; 'tessera --help' lists those there are\n";
      return ExitCode::usage;
    }
    return tool.exit(e) == 0 ? ExitCode::ok : ExitCode::usage;
  } catch (const Failure& failure) {
    std::cerr << "tessera: " << failure.what() << "\n";
    for (const auto& [pointer, detail] : failure.errors()) std::cerr << "  " << pointer << ": " << detail << "\n";
    return exit_code(failure.kind());
  }
}

}  // namespace
}  // namespace tessera::client

int main(int argc, char** argv) { return static_cast<int>(tessera::client::run(argc, argv)); }
