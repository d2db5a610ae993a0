#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include "core/accel/accel_table.h"

namespace tessera {

inline constexpr BoundKind kBounds[] = {BoundKind::box, BoundKind::sphere, BoundKind::slabs, BoundKind::hull};

inline bool takes(const AccelEntry& row, std::string_view option) {
  return std::ranges::find(row.options, option) != row.options.end();
}

/// Every structure × bound × space there is, from the table; slabs with each preset and with skewed normals of a user,
/// lists with groups, leaves of one item.
inline std::vector<AccelOptions> accel_choices() {
  std::vector<AccelOptions> choices;
  for (const AccelEntry& row : accel_table()) {
    AccelOptions options{row.kind};
    choices.push_back(options);
    if (takes(row, "bound"))
      for (const BoundKind bound : kBounds)
        for (const BoundSpace space : {BoundSpace::world, BoundSpace::object}) {
          options.bound = bound;
          options.space = space;
          if (options != choices.back()) choices.push_back(options);
        }
    AccelOptions slabs{row.kind, BoundKind::slabs};
    if (takes(row, "normals")) {
      for (const int preset : {3, 9, 13}) {
        slabs.normals = slab_preset(preset);
        choices.push_back(slabs);
      }
      slabs.normals = {{1, 2, 3}, {-0.3F, 0.1F, 5}, {1e-3F, 1, -1e-3F}, {0, 0, 2}};
      choices.push_back(slabs);
    }
    if (takes(row, "group_size")) {
      AccelOptions grouped{row.kind, BoundKind::sphere};
      grouped.group_size = 5;
      choices.push_back(grouped);
      grouped.space = BoundSpace::object;
      choices.push_back(grouped);
    }
    if (takes(row, "leaf_size")) {
      AccelOptions single{row.kind};
      single.leaf_size = 1;
      choices.push_back(single);
    }
  }
  return choices;
}

/// The least and the most that each number of each structure may be, under every bound that it goes with; 1 where 0
/// stands for a default. The rest is as it is but for leaves of one item, so that what is cut is cut often.
inline std::vector<AccelOptions> accel_extremes() {
  std::vector<AccelOptions> choices;
  for (const AccelEntry& row : accel_table())
    for (const AccelOptionEntry& option : accel_option_table()) {
      if (option.type != AccelOptionType::number || !takes(row, option.name)) continue;
      for (const BoundKind bound : kBounds) {
        if (option.only_with && *option.only_with != bound) continue;
        if (bound != BoundKind::box && !takes(row, "bound")) continue;
        for (const std::uint32_t value : {std::max(option.least, 1U), option.most}) {
          AccelOptions options{row.kind, bound};
          options.leaf_size = 1;
          options.*option.number = value;
          choices.push_back(options);
        }
      }
    }
  return choices;
}

}  // namespace tessera
