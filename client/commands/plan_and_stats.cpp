#include <algorithm>
#include <iostream>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/commands/commands.h"

namespace tessera::client {
namespace {

using nlohmann::json;
using Ask = json (Client::*)(const std::string& id) const;

std::string plain(const json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

/// Members as aligned "name  value" lines, deeper ones indented: whatever a server tells, readable.
void print_tree(const json& tree, std::size_t indent) {
  const std::string margin(indent, ' ');
  if (tree.is_array()) {
    for (const json& item : tree) {
      if (item.is_structured()) {
        print_tree(item, indent);
        std::cout << "\n";
      } else {
        std::cout << margin << plain(item) << "\n";
      }
    }
    return;
  }
  std::size_t width = 0;
  for (const auto& [name, value] : tree.items()) width = std::max(width, name.size());
  for (const auto& [name, value] : tree.items()) {
    std::cout << margin << name;
    if (value.is_structured()) {
      std::cout << "\n";
      print_tree(value, indent + 2);
    } else {
      std::cout << std::string(width + 2 - name.size(), ' ') << plain(value) << "\n";
    }
  }
}

void add(CLI::App& tool, Session& session, const char* name, const char* description, Ask ask) {
  CLI::App* command = tool.add_subcommand(name, description);
  const auto id = std::make_shared<std::string>();
  command->add_option("ID", *id, "The job")->required();
  command->callback([id, ask, &session] {
    const json answer = (session.client().*ask)(*id);
    if (session.json) {
      std::cout << answer.dump(2) << "\n";
    } else if (!answer.value("ready", true)) {
      std::cout << "not planned yet\n";
    } else {
      print_tree(answer, 0);
    }
  });
}

}  // namespace

void add_plan_and_stats(CLI::App& tool, Session& session) {
  add(tool, session, "plan", "Print how a job is rendered, and why", &Client::plan);
  add(tool, session, "stats", "Print what a job cost", &Client::stats);
}

}  // namespace tessera::client
