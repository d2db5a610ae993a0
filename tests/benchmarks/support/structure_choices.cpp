#include "tests/benchmarks/support/structure_choices.h"

#include <algorithm>

#include "tests/benchmarks/support/svg.h"

namespace tessera::bench {

std::vector<StructureChoice> structure_choices() {
  std::vector<StructureChoice> choices;
  for (const AccelEntry& row : accel_table()) {
    const std::string kind(row.name);
    if (std::ranges::find(row.options, "bound") == row.options.end()) {
      choices.push_back({kind, {row.kind}});
      continue;
    }
    for (std::size_t i = 0; i < bound_names().size(); ++i) {
      AccelOptions options{row.kind, static_cast<BoundKind>(i)};
      if (options.bound != BoundKind::slabs) {
        choices.push_back({kind + " " + std::string(bound_names()[i]), options});
        continue;
      }
      for (const int preset : {7, 13}) {
        options.normals = slab_preset(preset);
        choices.push_back({kind + " slabs·" + std::to_string(preset), options});
      }
    }
  }
  return choices;
}

std::string color_of(AccelKind kind) {
  // In the table's order; brute force, the last resort, is grey.
  const auto at = static_cast<std::size_t>(accel_entry(kind) - accel_table().data());
  return kColors[(at + kColors.size() - 1) % kColors.size()];
}

}  // namespace tessera::bench
