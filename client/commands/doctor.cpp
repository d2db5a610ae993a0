#include "client/doctor.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/columns.h"
#include "client/commands/commands.h"
#include "client/failure.h"

namespace tessera::client {
namespace {

using nlohmann::json;

const char* word_for(Finding::Verdict verdict) {
  return verdict == Finding::Verdict::ok ? "ok" : verdict == Finding::Verdict::warn ? "warn" : "FAIL";
}

void print_findings(Session& session, const std::vector<Finding>& findings) {
  std::size_t width = 0;
  for (const Finding& finding : findings) width = std::max(width, columns_of(finding.check));
  for (const Finding& finding : findings) {
    const std::string advice = finding.advice.empty() ? "" : " -> " + finding.advice;
    session.print(padded(word_for(finding.verdict), 6) + padded(finding.check, width + 2) + finding.detail + advice);
  }
}

json to_json(const std::vector<Finding>& findings) {
  json list = json::array();
  for (const Finding& finding : findings)
    list.push_back({{"verdict", word_for(finding.verdict)},
                    {"check", finding.check},
                    {"detail", finding.detail},
                    {"advice", finding.advice}});
  return {{"findings", std::move(list)}};
}

/// Of a server that can't be asked there are none, which has been told by then.
std::map<std::string, double> metrics_of(const Client& client) try {
  return read_metrics(client.ask("/metrics").body);
} catch (const Failure&) {
  return {};
}

/// Nothing where none is shown.
std::optional<std::chrono::sys_seconds> certificate_end_of(const Client& client) try {
  return client.ask("/livez").certificate_expires;
} catch (const Failure&) {
  return std::nullopt;
}

}  // namespace

void add_doctor(CLI::App& tool, Session& session) {
  CLI::App* command =
      tool.add_subcommand("doctor", "Look whether the server is well: a line for each check, with what to do");
  const auto data_dir = std::make_shared<std::string>();
  command->add_option("--data-dir", *data_dir,
                      "The server's data folder, where it runs on this machine: look at that, too");
  const auto certificate = std::make_shared<std::string>(), key = std::make_shared<std::string>();
  CLI::Option* of_certificate =
      command->add_option("--tls-certificate", *certificate,
                          "The server's certificate, where its file is on this machine: look at that, too");
  of_certificate->needs(command->add_option("--tls-key", *key, "The key of that certificate")->needs(of_certificate));
  command->footer("Exit codes: 0 when nothing is wrong, warnings aside; 1 when something is.");
  command->callback([&session, data_dir, certificate, key] {
    const Client client = session.client();
    std::vector<Finding> findings = examine_server(client, TESSERA_VERSION);
    if (!data_dir->empty())
      std::ranges::move(examine_machine(*data_dir, metrics_of(client)), std::back_inserter(findings));
    if (!certificate->empty())
      std::ranges::move(examine_certificate(*certificate, *key, certificate_end_of(client)),
                        std::back_inserter(findings));
    if (session.json)
      session.print_json(to_json(findings));
    else
      print_findings(session, findings);
    const auto is_wrong = [](const Finding& finding) { return finding.verdict == Finding::Verdict::fail; };
    if (std::ranges::any_of(findings, is_wrong)) session.exit_code = ExitCode::job_did_not_complete;
  });
}

}  // namespace tessera::client
