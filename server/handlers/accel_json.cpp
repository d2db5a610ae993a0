#include "server/handlers/accel_json.h"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "core/accel/accel_table.h"
#include "core/bounds/slab_presets.h"

namespace tessera::server {
namespace {

using nlohmann::json;

std::string_view bound_name(BoundKind bound) { return bound_names()[static_cast<std::size_t>(bound)]; }
std::string_view space_name(BoundSpace space) { return space_names()[static_cast<std::size_t>(space)]; }

json normals_json(const std::vector<Vec3>& normals) {
  json list = json::array();
  for (const Vec3 n : normals) list.push_back({n.x, n.y, n.z});
  return list;
}

json value_json(const AccelOptionEntry& option, const AccelOptions& options) {
  switch (option.type) {
    case AccelOptionType::number:
      return options.*option.number;
    case AccelOptionType::bound:
      return bound_name(options.bound);
    case AccelOptionType::space:
      return space_name(options.space);
    case AccelOptionType::normals:
      return normals_json(options.normals);
  }
  return {};
}

json type_json(const AccelOptionEntry& option) {
  switch (option.type) {
    case AccelOptionType::number:
      return {{"type", "integer"}, {"least", option.least}, {"most", option.most}};
    case AccelOptionType::bound:
      return {{"type", "word"}, {"values", bound_names()}};
    case AccelOptionType::space:
      return {{"type", "word"}, {"values", space_names()}};
    case AccelOptionType::normals:
      return {{"type", "normals"}, {"presets", kSlabPresets}, {"most", kMostNormals}};
  }
  return {};
}

json option_json(const AccelOptionEntry& option) {
  json row{{"name", option.name}, {"summary", option.summary}, {"default", value_json(option, {})}};
  row.update(type_json(option));
  if (option.only_with) row["only_with"] = {{"bound", bound_name(*option.only_with)}};
  return row;
}

}  // namespace

json accel_options_json(const AccelOptions& options) {
  json values = json::object();
  const AccelEntry* row = accel_entry(options.kind);
  if (!row) return values;
  for (const AccelOptionEntry& option : accel_option_table()) {
    const bool is_read = std::ranges::find(row->options, option.name) != row->options.end();
    if (is_read && (!option.only_with || *option.only_with == options.bound))
      values[option.name] = value_json(option, options);
  }
  return values;
}

json accel_capabilities_json() {
  json list = json::array();
  list.push_back({{"kind", accel_name(AccelKind::automatic)},
                  {"summary", "the plan picks one of the others"},
                  {"options", json::array()}});
  for (const AccelEntry& row : accel_table()) {
    json options = json::array();
    for (const AccelOptionEntry& option : accel_option_table())
      if (std::ranges::find(row.options, option.name) != row.options.end()) options.push_back(option_json(option));
    list.push_back({{"kind", row.name}, {"summary", row.summary}, {"options", std::move(options)}});
  }
  return list;
}

}  // namespace tessera::server
