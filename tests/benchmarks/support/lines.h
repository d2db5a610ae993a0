#pragma once

#include <array>
#include <string>
#include <vector>

namespace tessera::bench {

/// A line of a log-log chart; `x` and `y` of its points are > 0.
struct Line {
  std::string label, color;
  std::string dashes = "none";  ///< SVG's stroke-dasharray.
  std::vector<std::array<double, 2>> points;
};

struct LineChart {
  std::string title;
  std::string (*tick)(double);  ///< The text beside a power of ten of y.
  std::vector<Line> lines;
};

/// Log-log charts side by side with a legend in common, as an SVG document. Every chart has the same lines, in the
/// same order.
std::string line_charts(const std::string& title, const std::string& subtitle, const std::string& x_title,
                        const std::vector<LineChart>& charts);

}  // namespace tessera::bench
