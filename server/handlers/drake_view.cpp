#include "server/handlers/drake_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include "proto/import/gltf/views_and_lights.h"
#include "server/handlers/json_members.h"

namespace tessera::server {
namespace {

using nlohmann::json;

/// The member's value; nothing where it isn't there, or twice.
std::optional<std::string_view> member(const std::vector<JsonMember>& members, std::string_view name) {
  if (std::ranges::count(members, name, &JsonMember::name) != 1) return std::nullopt;
  return std::ranges::find(members, name, &JsonMember::name)->value;
}

/// The only node with a camera, and its index.
struct CameraNode {
  std::string_view text;
  std::size_t index;
};

std::optional<CameraNode> camera_node(const std::vector<std::string_view>& nodes) {
  std::optional<CameraNode> found;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].find("\"camera\"") == std::string_view::npos || !has_member(nodes[i], "camera")) continue;
    if (found) return std::nullopt;
    found = CameraNode{nodes[i], i};
  }
  return found;
}

bool is_a_child(std::size_t index, const std::vector<std::string_view>& nodes) {
  for (const std::string_view node : nodes) {
    if (node.find("\"children\"") == std::string_view::npos) continue;
    const auto children = member(json_members(node), "children");
    const json list = children ? json::parse(*children, nullptr, false) : json();
    if (!list.is_array() || std::ranges::find(list, json(index)) != list.end()) return true;
  }
  return false;
}

/// Column by column, as a rotation and a translation; nothing for others, of which the importer says what it does.
std::optional<proto::Rows> read_matrix(std::string_view text) {
  constexpr double kRounding = 1e-4;
  const json numbers = json::parse(text, nullptr, false);
  const auto is_number = [](const json& value) { return value.is_number(); };
  if (!numbers.is_array() || numbers.size() != 16 || !std::ranges::all_of(numbers, is_number)) return std::nullopt;
  const auto at = [&](std::size_t row, std::size_t column) { return numbers[column * 4 + row].get<double>(); };
  proto::Rows rows{};
  for (std::size_t column = 0; column < 4; ++column) {
    if (at(3, column) != (column == 3 ? 1 : 0)) return std::nullopt;
    for (std::size_t row = 0; row < 3; ++row) rows[row * 4 + column] = at(row, column);
    for (std::size_t other = 0; column < 3 && other <= column; ++other) {
      const double product = at(0, column) * at(0, other) + at(1, column) * at(1, other) + at(2, column) * at(2, other);
      if (!(std::abs(product - (other == column ? 1 : 0)) < kRounding)) return std::nullopt;
    }
  }
  return rows;
}

}  // namespace

std::optional<DrakeView> find_drake_view(std::string_view gltf) {
  const auto all = member(json_members(gltf), "nodes");
  if (!all || all->find('\\') != std::string_view::npos) return std::nullopt;
  const std::vector<std::string_view> nodes = json_elements(*all);
  const auto node = camera_node(nodes);
  if (!node || is_a_child(node->index, nodes)) return std::nullopt;
  const std::vector<JsonMember> members = json_members(node->text);
  for (const JsonMember& other : members)
    if (other.name != "camera" && other.name != "matrix" && other.name != "name") return std::nullopt;
  const auto matrix = member(members, "matrix");
  const auto rows = matrix ? read_matrix(*matrix) : std::nullopt;
  const auto camera = rows ? proto::placed(Camera(PerspectiveCamera()), *rows) : std::nullopt;
  if (!camera) return std::nullopt;
  const auto begin = static_cast<std::size_t>(matrix->data() - gltf.data());
  proto::Sha256 rest;
  rest.update("drake ");
  rest.update(gltf.substr(0, begin));
  rest.update(gltf.substr(begin + matrix->size()));
  return DrakeView{rest.finish(), std::visit([](const auto& c) { return c.view; }, *camera)};
}

}  // namespace tessera::server
