#pragma once

#include <cstddef>

#include "client/commands/session.h"

namespace tessera::client {

/// Adds members to the answer as aligned "name  value" lines, deeper ones indented: whatever a server tells, readable.
void print_tree(Session& session, const nlohmann::json& tree, std::size_t indent = 0);

}  // namespace tessera::client
