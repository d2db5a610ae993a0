#include <algorithm>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <signal.h>
#include <unistd.h>

#include "client/commands/commands.h"
#include "client/failure.h"

namespace tessera::client {

namespace {

constexpr const char* kExitCodes =
    "Exit codes:\n"
    "  0  all went well\n"
    "  1  the job failed or was canceled, or doctor found something wrong\n"
    "  2  the command line is wrong\n"
    "  3  the server refused; what is wrong stands on stderr, a line for each place\n"
    "  4  the server can't be reached, or trusted\n"
    "  5  a local file, or stdout, can't be read or written, or a file may not be uploaded\n"
    "130  Ctrl-C; a job that was submitted goes on\n";

/// Closed streams get something that can't be used as they are meant, or the next file or connection would be one.
void hold_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) < 0) open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}

/// What is left of a command line, in its order.
std::string in_a_row(const std::vector<std::string>& words) {
  std::string row;
  for (const std::string& word : words) row += (row.empty() ? "" : " ") + word;
  return row;
}

void run_commands(CLI::App& tool, Session& session, int argc, char** argv) try {
  tool.parse(argc, argv);
} catch (const CLI::Success& asked) {  // --help, --version
  std::ostringstream text, none;
  tool.exit(asked, text, none);
  std::string line;
  for (std::istringstream lines(text.str()); std::getline(lines, line);) session.print(line);
} catch (const CLI::ParseError& error) {
  const auto left = tool.remaining(true);
  const auto commands = tool.get_subcommands();
  const std::string command = commands.empty() ? "tessera" : "tessera " + commands.front()->get_name();
  std::string what = error.what();
  if (commands.empty() && !left.empty()) what = "there is no command '" + left.front() + "'";
  if (!commands.empty() && !left.empty()) what = "too much was given: " + in_a_row(left);
  session.fail(ExitCode::usage, what + "; '" + command + " --help' lists what there is");
} catch (const Failure& failure) {
  session.fail(failure);
} catch (const nlohmann::json::exception& error) {
  session.fail(ExitCode::refused, std::string("the server's answer isn't understood: ") + error.what());
} catch (const std::exception& error) {
  session.fail(ExitCode::local_file, std::string("can't go on: ") + error.what());
}

ExitCode run(int argc, char** argv) {
  CLI::App tool("Renders scenes on a Tessera server.", "tessera");
  tool.footer(kExitCodes);
  tool.require_subcommand(1);
  tool.fallthrough();
  tool.set_version_flag("--version", TESSERA_VERSION);

  Session session;
  // Known before the command line is understood, which may be what fails.
  session.json = std::any_of(argv, argv + argc, [](std::string_view word) { return word == "--json"; });
  tool.add_option("--server", session.server_url, "The server's URL")->envname("TESSERA_SERVER")->capture_default_str();
  tool.add_option("--key-file", session.key_file, "File that holds the key for the server; else TESSERA_KEY does");
  tool.add_option("--ca-file", session.ca_file,
                  "PEM file with the certificates of who vouches for an https:// server, in place of the system's")
      ->envname("TESSERA_CA_FILE");
  tool.add_flag("--json", session.json, "Answers on stdout are JSON, and so are errors on stderr");
  add_render(tool, session);
  add_submit(tool, session);
  add_watch(tool, session);
  add_fetch(tool, session);
  add_list(tool, session);
  add_cancel_and_delete(tool, session);
  add_plan_and_stats(tool, session);
  add_capabilities(tool, session);
  add_keys(tool, session);
  add_doctor(tool, session);

  run_commands(tool, session, argc, argv);
  return session.finish();
}

}  // namespace
}  // namespace tessera::client

int main(int argc, char** argv) {
  tessera::client::hold_standard_streams();
  // What can't be written is an error that is told, and a job is looked after all the same.
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
  return static_cast<int>(tessera::client::run(argc, argv));
}
