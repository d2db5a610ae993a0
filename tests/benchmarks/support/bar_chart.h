#pragma once

#include <string>
#include <vector>

#include "tests/benchmarks/support/samples.h"

namespace tessera::bench {

/// A group of bars, one for each series; no bar where there are no samples.
struct BarGroup {
  std::string label;
  std::vector<Samples> bars;
};

/// Horizontal bars at the medians, whiskers from quartile to quartile, as an SVG document.
std::string bar_chart(const std::string& title, const std::string& unit, const std::vector<std::string>& series,
                      const std::vector<BarGroup>& groups);

}  // namespace tessera::bench
