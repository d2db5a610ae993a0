#include "tests/benchmarks/support/bar_chart.h"

#include <algorithm>
#include <cmath>

#include "tests/benchmarks/support/report.h"
#include "tests/benchmarks/support/svg.h"

namespace tessera::bench {
namespace {

constexpr double kLeft = 130, kTop = 56, kPlotWidth = 640, kBarHeight = 9, kGroupGap = 10;

/// 1, 2 or 5 times a power of ten, so that the axis has five to ten marks.
double step_for(double largest) {
  const double power = std::pow(10, std::floor(std::log10(largest / 5)));
  for (const double factor : {1, 2, 5})
    if (largest / (factor * power) <= 10) return factor * power;
  return 10 * power;
}

}  // namespace

std::string bar_chart(const std::string& title, const std::string& unit, const std::vector<std::string>& series,
                      const std::vector<BarGroup>& groups) {
  double largest = 1e-9, bottom = kTop;
  for (const BarGroup& group : groups) {
    bottom += kGroupGap + kBarHeight * static_cast<double>(group.bars.size());
    for (const Samples& bar : group.bars)
      if (!bar.empty()) largest = std::max(largest, bar.quantile(0.75));
  }
  const double scale = kPlotWidth / (largest * 1.05), width = kLeft + kPlotWidth + 30, height = bottom + 46;

  Svg svg(width, height);
  svg.text(kLeft, 20, title);
  for (std::size_t s = 0; s < series.size(); ++s) {
    const double x = kLeft + 120 * static_cast<double>(s);
    svg.rectangle(x, 32, 10, 10, kColors[s % kColors.size()]);
    svg.text(x + 14, 41, series[s]);
  }
  const double step = step_for(largest);
  for (double v = 0; v <= largest * 1.05; v += step) {
    svg.line(kLeft + v * scale, kTop, kLeft + v * scale, bottom, v == 0 ? "black" : "#ddd");
    svg.text(kLeft + v * scale, bottom + 16, fixed(v, step < 1 ? 1 : 0), {.anchor = "middle"});
  }
  svg.text(kLeft + kPlotWidth / 2, bottom + 34, unit, {.anchor = "middle"});

  double y = kTop + kGroupGap / 2;
  for (const BarGroup& group : groups) {
    svg.text(kLeft - 6, y + kBarHeight * static_cast<double>(group.bars.size()) / 2 + 4, group.label,
             {.anchor = "end"});
    for (std::size_t s = 0; s < group.bars.size(); ++s, y += kBarHeight) {
      const Samples& bar = group.bars[s];
      if (bar.empty()) continue;
      svg.rectangle(kLeft, y, bar.median() * scale, kBarHeight - 1, kColors[s % kColors.size()]);
      const double middle = y + (kBarHeight - 1) / 2;
      svg.line(kLeft + bar.quantile(0.25) * scale, middle, kLeft + bar.quantile(0.75) * scale, middle, "black");
    }
    y += kGroupGap;
  }
  return svg.finish();
}

}  // namespace tessera::bench
