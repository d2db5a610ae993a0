#include <algorithm>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "client/columns.h"
#include "client/commands/commands.h"
#include "client/commands/print_tree.h"

namespace tessera::client {
namespace {

using nlohmann::json;

std::string joined(const json& values) {
  std::string text;
  for (const json& value : values)
    text += (text.empty() ? "" : "|") + (value.is_string() ? value.get<std::string>() : value.dump());
  return text;
}

/// What --accel takes for an option: "leaf_size=1..255", "bound=box|sphere|slabs|hull".
std::string form_of(const json& option) {
  std::string form = option.value("name", "") + '=';
  const std::string type = option.value("type", "");
  if (type == "integer") return form + option["least"].dump() + ".." + option["most"].dump();
  if (type == "normals") return form + joined(option["presets"]) + "|x:y:z/x:y:z...";
  return form + joined(option.value("values", json::array()));
}

std::string summary_of(const json& option) {
  std::string summary = option.value("summary", "");
  const json only_with = option.value("only_with", json::object());
  for (const auto& [name, value] : only_with.items()) summary += "; with " + name + '=' + value.get<std::string>();
  const json preset = option.value("default", json());
  return preset.is_array() ? summary : summary + " [" + joined(json::array({preset})) + ']';
}

void print_accel(Session& session, const json& kinds) {
  session.print("accel");
  for (const json& row : kinds) {
    session.print("  " + row.value("kind", "") + ": " + row.value("summary", ""));
    const json options = row.value("options", json::array());
    std::size_t width = 0;
    for (const json& option : options) width = std::max(width, columns_of(form_of(option)));
    for (const json& option : options) session.print("    " + padded(form_of(option), width + 2) + summary_of(option));
  }
}

}  // namespace

void add_capabilities(CLI::App& tool, Session& session) {
  CLI::App* command = tool.add_subcommand("capabilities", "Print what the server can do, and what --accel takes");
  command->callback([&session] {
    json answer = session.client().capabilities();
    if (session.json) return session.print_json(answer);
    print_accel(session, answer.value("accel", json::array()));
    answer.erase("accel");
    print_tree(session, answer);
  });
}

}  // namespace tessera::client
