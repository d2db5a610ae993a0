#pragma once

#include <string>
#include <vector>

#include "tests/benchmarks/support/panels.h"

namespace tessera::bench {

/// A dot of a scatter panel.
struct Dot {
  std::string label;  ///< Written beside it; none where it is empty.
  std::string color;
  double x = 0, y = 0;       ///< > 0
  bool is_contrast = false;  ///< Drawn as a ring.
};

struct ScatterPanel {
  std::string title, subtitle;
  std::vector<std::string> notes;  ///< Lines below the axis.
  std::vector<Dot> dots;
};

/// Small multiples with both axes logarithmic, x a time in seconds, as an SVG document. The y axis is the same in all
/// panels, the x axis is each one's own.
std::string scatter_chart(const std::string& title, const std::string& subtitle, const std::string& y_title,
                          const std::vector<LegendEntry>& legend, const std::vector<ScatterPanel>& panels);

}  // namespace tessera::bench
