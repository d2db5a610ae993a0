#pragma once

#include <cstddef>

#include <nlohmann/json_fwd.hpp>

namespace tessera::client {

/// Members as aligned "name  value" lines on stdout, deeper ones indented: whatever a server tells, readable.
void print_tree(const nlohmann::json& tree, std::size_t indent = 0);

}  // namespace tessera::client
