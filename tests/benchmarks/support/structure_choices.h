#pragma once

#include <string>
#include <vector>

#include "core/accel/accel_table.h"

namespace tessera::bench {

/// A structure that a benchmark measures.
struct StructureChoice {
  std::string label;  ///< Short, e.g. "bvh slabs·7".
  AccelOptions options;
};

/// Every kind of the table; with each bound where it takes one, slabs with 7 and with 13 normals; other options at
/// their defaults.
std::vector<StructureChoice> structure_choices();

/// The kind's colour in plots.
std::string color_of(AccelKind kind);

}  // namespace tessera::bench
