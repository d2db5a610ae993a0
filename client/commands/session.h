#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "client/client.h"

namespace tessera::client {

/// How the tool ends; scripts rely on these.
enum class ExitCode {
  ok = 0,
  job_did_not_complete = 1,  ///< Or something else is found to be wrong.
  usage = 2,
  refused = 3,
  unreachable = 4,
  local_file = 5,
  interrupted = 130,
  reader_has_gone = 141,  ///< Of what was written to stdout, as if SIGPIPE had ended the tool.
};

/// What every command knows, and all that it says. Answers go to stdout, everything else to stderr; under --json an
/// answer is a JSON document, and everything else JSON objects, a line each. Names and words that others chose are
/// made printable here and nowhere else.
class Session {
 public:
  std::string server_url = "http://127.0.0.1:8080";
  std::string key_file, ca_file;
  bool json = false;
  ExitCode exit_code = ExitCode::ok;

  /// Shows the server the key of `key_file`, or else of the environment's TESSERA_KEY: the command line would tell it
  /// to whoever lists processes. Throws `CLI::ValidationError`, `Failure`.
  Client client() const;

  /// Adds to the answer, which `finish` writes.
  void print(std::string_view line);
  void print_json(const nlohmann::json& document);

  /// Writes the answer; ends with the exit code of it all. What can't be written is an error.
  ExitCode finish();

  /// Something worth knowing.
  void note(std::string_view text) const;

  /// What the server left out or didn't understand.
  void warn(const proto::FieldError& warning) const;

  /// Why a command didn't do what it says, and sets the exit code. `kind` is usage, job, refused, unreachable,
  /// local_file or interrupted.
  void fail(ExitCode code, const std::string& message, const nlohmann::json& more = nlohmann::json::object());
  void fail(const class Failure& failure);

  /// What Ctrl-C says from now on, and that it ends the tool. Empty to say nothing.
  void on_interrupt(const std::string& message, const std::string& job = {}) const;

  /// A line on stderr, for people alone.
  void tell(std::string_view line) const;

  /// An answer that goes to stderr, because stdout has an image.
  void tell_json(const nlohmann::json& document) const;

 private:
  std::string answer_;
};

}  // namespace tessera::client
