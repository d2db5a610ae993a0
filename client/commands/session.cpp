#include "client/commands/session.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <system_error>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "client/failure.h"
#include "client/interrupt.h"
#include "client/output_file.h"
#include "proto/wire/printable.h"

namespace tessera::client {
namespace {

using nlohmann::json;

constexpr int kIndented = 2, kInOneLine = -1;

/// All beyond ASCII is escaped, DEL and C1 controls with it, and a name that isn't UTF-8 is no reason to fail.
std::string text_of(const json& document, int indent) {
  return document.dump(indent, ' ', true, json::error_handler_t::replace);
}

const char* name(ExitCode code) {
  switch (code) {
    case ExitCode::job_did_not_complete:
      return "job";
    case ExitCode::refused:
      return "refused";
    case ExitCode::unreachable:
      return "unreachable";
    case ExitCode::local_file:
      return "local_file";
    case ExitCode::interrupted:
      return "interrupted";
    default:
      return "usage";
  }
}

json error_of(ExitCode code, const std::string& message) {
  return {{"kind", name(code)}, {"message", message}, {"errors", json::array()}};
}

ExitCode exit_code(Failure::Kind kind) {
  switch (kind) {
    case Failure::Kind::usage:
      return ExitCode::usage;
    case Failure::Kind::refused:
      return ExitCode::refused;
    case Failure::Kind::unreachable:
    case Failure::Kind::untrusted:
      return ExitCode::unreachable;
    case Failure::Kind::local_file:
      return ExitCode::local_file;
  }
  return ExitCode::refused;
}

/// Empty where there is none.
std::string read_key(const std::string& path) {
  const char* variable = std::getenv("TESSERA_KEY");
  std::string key = variable ? variable : "";
  if (!path.empty()) {
    std::ifstream file(path);
    if (!(file >> key)) throw Failure(Failure::Kind::local_file, "can't read a key from " + path);
  }
  const auto is_printable = [](char c) { return c > ' ' && c < 0x7F; };
  if (!std::ranges::all_of(key, is_printable))
    throw Failure(Failure::Kind::usage, "the key holds characters that no key has");
  return key;
}

void write_to_stderr(const std::string& line) { std::fputs((line + '\n').c_str(), stderr); }

}  // namespace

Client Session::client() const {
  auto address = parse_server_url(server_url);
  if (!address) throw CLI::ValidationError("--server", "'" + server_url + "' isn't a URL like http://127.0.0.1:8080");
  address->ca_file = ca_file;
  return Client(*address, read_key(key_file));
}

void Session::print(std::string_view line) { answer_ += proto::printable(line) + '\n'; }

void Session::print_json(const nlohmann::json& document) { answer_ += text_of(document, kIndented) + '\n'; }

ExitCode Session::finish() {
  const std::error_code error = write_to_stdout(answer_);
  if (error == std::errc::broken_pipe) return ExitCode::reader_has_gone;
  if (error) fail(ExitCode::local_file, "can't write to stdout: " + error.message());
  return exit_code;
}

void Session::note(std::string_view text) const {
  json ? tell_json({{"note", text}}) : tell("note: " + std::string(text));
}

void Session::warn(const proto::FieldError& warning) const {
  const auto& [pointer, detail] = warning;
  if (json) return tell_json({{"warning", {{"pointer", pointer}, {"detail", detail}}}});
  tell("warning: " + (pointer.empty() ? "" : pointer + ": ") + detail);
}

void Session::fail(ExitCode code, const std::string& message, const nlohmann::json& more) {
  exit_code = code;
  nlohmann::json error = error_of(code, message);
  error.update(more);
  if (json) return tell_json({{"error", error}});
  tell((code == ExitCode::job_did_not_complete ? "" : "tessera: ") + message);
  for (const nlohmann::json& place : error["errors"])
    tell("  " + place["pointer"].get<std::string>() + ": " + place["detail"].get<std::string>());
}

void Session::fail(const Failure& failure) {
  nlohmann::json more{{"errors", nlohmann::json::array()}};
  for (const auto& [pointer, detail] : failure.errors())
    more["errors"].push_back({{"pointer", pointer}, {"detail", detail}});
  if (!failure.code().empty()) more["code"] = failure.code();
  fail(client::exit_code(failure.kind()), failure.what(), more);
}

void Session::on_interrupt(const std::string& message, const std::string& job) const {
  if (message.empty()) return client::on_interrupt("");
  if (json) {
    nlohmann::json error = error_of(ExitCode::interrupted, message);
    if (!job.empty()) error["job"] = job;
    return client::on_interrupt(text_of({{"error", error}}, kInOneLine) + '\n');
  }
  // A terminal shows ^C behind a line that may be half drawn.
  client::on_interrupt((isatty(STDERR_FILENO) != 0 ? "\n" : "") + proto::printable(message) + '\n');
}

void Session::tell(std::string_view line) const { write_to_stderr(proto::printable(line)); }

void Session::tell_json(const nlohmann::json& document) const { write_to_stderr(text_of(document, kInOneLine)); }

}  // namespace tessera::client
