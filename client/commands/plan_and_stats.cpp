#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/accel_argument.h"
#include "client/columns.h"
#include "client/commands/commands.h"
#include "client/commands/print_tree.h"

namespace tessera::client {
namespace {

using nlohmann::json;
using Ask = json (Client::*)(const std::string& id) const;
using Print = void (*)(Session& session, json answer);

double seconds(const json& candidate, const char* name) {
  const json value = candidate.value(name, json());
  return value.is_number() ? value.get<double>() : 0;
}

std::string four_digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

/// A line for each structure, in the form that --accel takes.
void print_candidates(Session& session, const json& candidates) {
  constexpr std::size_t kNumber = 10;
  std::vector<std::string> names;
  std::size_t width = 0;
  for (const json& candidate : candidates) {
    names.push_back(accel_argument(candidate.value("kind", ""), candidate.value("options", json::object())));
    width = std::max(width, columns_of(names.back()));
  }
  const auto print_row = [&](const std::string& name, const std::string& build, const std::string& trace,
                             const std::string& total) {
    session.print("  " + padded(name, width) + "  " + flush_right(build, kNumber) + "  " + flush_right(trace, kNumber) +
                  "  " + flush_right(total, kNumber));
  };
  session.print("candidates");
  print_row("structure", "build s", "trace s", "total s");
  for (std::size_t i = 0; i < names.size(); ++i)
    print_row(names[i], four_digits(seconds(candidates[i], "build_seconds")),
              four_digits(seconds(candidates[i], "trace_seconds")),
              four_digits(seconds(candidates[i], "total_seconds")));
}

void print_plan(Session& session, json plan) {
  if (!plan.value("ready", true)) return session.print("not planned yet");
  const json candidates = plan.value("candidates", json::array());
  plan.erase("candidates");
  print_tree(session, plan);
  if (!candidates.empty()) print_candidates(session, candidates);
}

void print_stats(Session& session, json stats) {
  if (stats.contains("tests") && stats["tests"].is_null()) stats["tests"] = "not counted; submit with --count-tests";
  print_tree(session, stats);
}

void add(CLI::App& tool, Session& session, const char* name, const char* description, Ask ask, Print print) {
  CLI::App* command = tool.add_subcommand(name, description);
  const auto id = std::make_shared<std::string>();
  add_job_argument(*command, *id);
  command->callback([id, ask, print, &session] {
    const Client client = session.client();
    const json answer = (client.*ask)(client.find_job(*id));
    session.json ? session.print_json(answer) : print(session, answer);
  });
}

}  // namespace

void add_plan_and_stats(CLI::App& tool, Session& session) {
  add(tool, session, "plan", "Print how a job is rendered, and why", &Client::plan, print_plan);
  add(tool, session, "stats", "Print what a job cost", &Client::stats, print_stats);
}

}  // namespace tessera::client
