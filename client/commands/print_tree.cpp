#include "client/commands/print_tree.h"

#include <algorithm>
#include <cstdio>
#include <string>

#include <nlohmann/json.hpp>

#include "client/columns.h"

namespace tessera::client {
namespace {

using nlohmann::json;

/// Whether it takes lines of its own. Lists of plain values, and of vectors, stand in one.
bool is_block(const json& value) {
  return value.is_object() || (value.is_array() && !value.empty() && value.front().is_object());
}

std::string plain(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_array() && std::ranges::all_of(value, &json::is_string)) {
    std::string list;
    for (const json& word : value) list += (list.empty() ? "" : ", ") + word.get<std::string>();
    return list.empty() ? "none" : list;
  }
  if (!value.is_number_float()) return value.dump(-1, ' ', false, json::error_handler_t::replace);
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value.get<double>());
  return text;
}

}  // namespace

void print_tree(Session& session, const json& tree, std::size_t indent) {
  const std::string margin(indent, ' ');
  if (tree.is_array()) {
    for (const json& item : tree) {
      print_tree(session, item, indent);
      session.print("");
    }
    return;
  }
  std::size_t width = 0;
  for (const auto& [name, value] : tree.items()) width = std::max(width, columns_of(name));
  for (const auto& [name, value] : tree.items()) {
    if (is_block(value)) {
      session.print(margin + name);
      print_tree(session, value, indent + 2);
    } else {
      session.print(margin + padded(name, width + 2) + plain(value));
    }
  }
}

}  // namespace tessera::client
