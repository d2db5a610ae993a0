#pragma once

#include <string>
#include <vector>

#include "core/accel/accel_table.h"

namespace tessera {

/// Every structure × bound × space there is, from the table; slabs with each preset and with skewed normals of a user,
/// lists with groups, leaves of one item.
inline std::vector<AccelOptions> accel_choices() {
  std::vector<AccelOptions> choices;
  for (const AccelEntry& row : accel_table()) {
    AccelOptions options{row.kind};
    choices.push_back(options);
    const auto takes = [&](std::string_view name) { return std::ranges::find(row.options, name) != row.options.end(); };
    if (takes("bound"))
      for (const BoundKind bound : {BoundKind::box, BoundKind::sphere, BoundKind::slabs, BoundKind::hull})
        for (const BoundSpace space : {BoundSpace::world, BoundSpace::object}) {
          options.bound = bound;
          options.space = space;
          if (options != choices.back()) choices.push_back(options);
        }
    AccelOptions slabs{row.kind, BoundKind::slabs};
    if (takes("normals")) {
      for (const int preset : {3, 9, 13}) {
        slabs.normals = slab_preset(preset);
        choices.push_back(slabs);
      }
      slabs.normals = {{1, 2, 3}, {-0.3F, 0.1F, 5}, {1e-3F, 1, -1e-3F}, {0, 0, 2}};
      choices.push_back(slabs);
    }
    if (takes("group_size")) {
      AccelOptions grouped{row.kind, BoundKind::sphere};
      grouped.group_size = 5;
      choices.push_back(grouped);
      grouped.space = BoundSpace::object;
      choices.push_back(grouped);
    }
    if (takes("leaf_size")) {
      AccelOptions single{row.kind};
      single.leaf_size = 1;
      choices.push_back(single);
    }
  }
  return choices;
}

}  // namespace tessera
