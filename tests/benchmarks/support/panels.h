#pragma once

#include <string>
#include <vector>

namespace tessera::bench {

/// A bar of a panel: a time in seconds, and the share of it that went before, marked within the bar.
struct PanelBar {
  std::string label;
  std::string color;
  double seconds = 0;
  double first_seconds = 0;
  bool is_marked = false;
};

struct Panel {
  std::string title, subtitle;
  std::vector<PanelBar> bars;
};

struct LegendEntry {
  std::string label, color;
};

/// Small multiples: a panel of horizontal bars each, on a logarithmic axis of its own, as an SVG document.
std::string panel_chart(const std::string& title, const std::string& subtitle, const std::vector<LegendEntry>& legend,
                        const std::vector<Panel>& panels);

}  // namespace tessera::bench
