#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/accel_argument.h"
#include "client/commands/commands.h"
#include "client/commands/print_tree.h"

namespace tessera::client {
namespace {

using nlohmann::json;
using Ask = json (Client::*)(const std::string& id) const;
using Print = void (*)(json answer);

double seconds(const json& candidate, const char* name) {
  const json value = candidate.value(name, json());
  return value.is_number() ? value.get<double>() : 0;
}

/// A line for each structure, in the form that --accel takes.
void print_candidates(const json& candidates) {
  std::vector<std::string> names;
  std::size_t width = 0;
  for (const json& candidate : candidates) {
    names.push_back(accel_argument(candidate.value("kind", ""), candidate.value("options", json::object())));
    width = std::max(width, names.back().size());
  }
  std::printf("candidates\n  %-*s  %10s  %10s  %10s\n", static_cast<int>(width), "structure", "build s", "trace s",
              "total s");
  for (std::size_t i = 0; i < names.size(); ++i)
    std::printf("  %-*s  %10.4g  %10.4g  %10.4g\n", static_cast<int>(width), names[i].c_str(),
                seconds(candidates[i], "build_seconds"), seconds(candidates[i], "trace_seconds"),
                seconds(candidates[i], "total_seconds"));
}

void print_plan(json plan) {
  if (!plan.value("ready", true)) {
    std::cout << "not planned yet\n";
    return;
  }
  const json candidates = plan.value("candidates", json::array());
  plan.erase("candidates");
  print_tree(plan);
  if (!candidates.empty()) {
    std::cout << std::flush;
    print_candidates(candidates);
  }
}

void print_stats(json stats) {
  if (stats.contains("tests") && stats["tests"].is_null()) stats["tests"] = "not counted; submit with --count-tests";
  print_tree(stats);
}

void add(CLI::App& tool, Session& session, const char* name, const char* description, Ask ask, Print print) {
  CLI::App* command = tool.add_subcommand(name, description);
  const auto id = std::make_shared<std::string>();
  command->add_option("ID", *id, "The job")->required();
  command->callback([id, ask, print, &session] {
    const json answer = (session.client().*ask)(*id);
    if (session.json) {
      std::cout << answer.dump(2) << "\n";
    } else {
      print(answer);
    }
  });
}

}  // namespace

void add_plan_and_stats(CLI::App& tool, Session& session) {
  add(tool, session, "plan", "Print how a job is rendered, and why", &Client::plan, print_plan);
  add(tool, session, "stats", "Print what a job cost", &Client::stats, print_stats);
}

}  // namespace tessera::client
