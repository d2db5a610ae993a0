#include "tests/benchmarks/support/bar_chart.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/benchmarks/support/report.h"

namespace tessera::bench {
namespace {

constexpr double kLeft = 130, kTop = 56, kPlotWidth = 640, kBarHeight = 9, kGroupGap = 10;
/// Okabe & Ito's colours, told apart by everyone.
constexpr std::array kColors = {"#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00"};

std::string text(double x, double y, const std::string& anchor, const std::string& words) {
  return "<text x='" + fixed(x, 1) + "' y='" + fixed(y, 1) + "' text-anchor='" + anchor + "'>" + words + "</text>\n";
}

std::string line(double x0, double y0, double x1, double y1, const std::string& color) {
  return "<path d='M" + fixed(x0, 1) + " " + fixed(y0, 1) + "L" + fixed(x1, 1) + " " + fixed(y1, 1) + "' stroke='" +
         color + "'/>\n";
}

std::string rectangle(double x, double y, double width, double height, const std::string& color) {
  return "<rect x='" + fixed(x, 1) + "' y='" + fixed(y, 1) + "' width='" + fixed(width, 1) + "' height='" +
         fixed(height, 1) + "' fill='" + color + "'/>\n";
}

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

  std::string svg = "<svg xmlns='http://www.w3.org/2000/svg' width='" + fixed(width, 0) + "' height='" +
                    fixed(height, 0) + "' font-family='sans-serif' font-size='11'>\n" +
                    rectangle(0, 0, width, height, "white") + text(kLeft, 20, "start", title);
  for (std::size_t s = 0; s < series.size(); ++s) {
    const double x = kLeft + 120 * static_cast<double>(s);
    svg += rectangle(x, 32, 10, 10, kColors[s % kColors.size()]) + text(x + 14, 41, "start", series[s]);
  }
  const double step = step_for(largest);
  for (double v = 0; v <= largest * 1.05; v += step) {
    svg += line(kLeft + v * scale, kTop, kLeft + v * scale, bottom, v == 0 ? "black" : "#ddd");
    svg += text(kLeft + v * scale, bottom + 16, "middle", fixed(v, step < 1 ? 1 : 0));
  }
  svg += text(kLeft + kPlotWidth / 2, bottom + 34, "middle", unit);

  double y = kTop + kGroupGap / 2;
  for (const BarGroup& group : groups) {
    svg += text(kLeft - 6, y + kBarHeight * static_cast<double>(group.bars.size()) / 2 + 4, "end", group.label);
    for (std::size_t s = 0; s < group.bars.size(); ++s, y += kBarHeight) {
      const Samples& bar = group.bars[s];
      if (bar.empty()) continue;
      svg += rectangle(kLeft, y, bar.median() * scale, kBarHeight - 1, kColors[s % kColors.size()]);
      const double middle = y + (kBarHeight - 1) / 2;
      svg += line(kLeft + bar.quantile(0.25) * scale, middle, kLeft + bar.quantile(0.75) * scale, middle, "black");
    }
    y += kGroupGap;
  }
  return svg + "</svg>\n";
}

}  // namespace tessera::bench
