#include "tests/benchmarks/support/lines.h"

#include <algorithm>
#include <cmath>

#include "tests/benchmarks/support/report.h"
#include "tests/benchmarks/support/svg.h"

namespace tessera::bench {
namespace {

constexpr double kMargin = 28, kTop = 96, kAxis = 52, kWidth = 290, kHeight = 380, kGap = 24, kLegend = 130;

/// The axis that holds coordinate `i` of all points.
LogAxis axis_over(const LineChart& chart, std::size_t i, double from, double to) {
  double lo = HUGE_VAL, hi = 0;
  for (const Line& line : chart.lines)
    for (const auto& point : line.points) {
      lo = std::min(lo, point[i]);
      hi = std::max(hi, point[i]);
    }
  return hi > 0 ? LogAxis(lo, hi, from, to) : LogAxis(1, 10, from, to);
}

void draw(Svg& svg, const LineChart& chart, double left, const std::string& x_title) {
  const double bottom = kTop + kHeight;
  const LogAxis across = axis_over(chart, 0, left, left + kWidth), up = axis_over(chart, 1, bottom, kTop);
  svg.text(left, kTop - 12, chart.title, {.size = 13, .bold = true});
  for (const double x : across.decades()) {
    svg.line(across.at(x), kTop, across.at(x), bottom, "#e8e8e8");
    svg.text(across.at(x), bottom + 16, power_of_ten_text(x), {.anchor = "middle", .color = "#555"});
  }
  for (const double y : up.decades()) {
    svg.line(left, up.at(y), left + kWidth, up.at(y), "#e8e8e8");
    svg.text(left - 6, up.at(y) + 4, chart.tick(y), {.anchor = "end", .color = "#555"});
  }
  svg.text(left + kWidth / 2, bottom + 36, x_title, {.anchor = "middle", .color = "#555"});
  for (const Line& line : chart.lines) {
    std::vector<std::array<double, 2>> points;
    for (const auto& [x, y] : line.points) points.push_back({across.at(x), up.at(y)});
    svg.polyline(points, line.color, 2, line.dashes);
    for (const auto& [x, y] : points) svg.circle(x, y, 3, line.color);
  }
}

}  // namespace

std::string line_charts(const std::string& title, const std::string& subtitle, const std::string& x_title,
                        const std::vector<LineChart>& charts) {
  const double step = kAxis + kWidth + kGap;
  const double legend = kMargin + step * static_cast<double>(charts.size());
  Svg svg(legend + kLegend + kMargin, kTop + kHeight + 56);
  svg.text(kMargin, 32, title, {.size = 18, .bold = true});
  svg.text(kMargin, 52, subtitle, {.size = 12, .color = "#555"});
  for (std::size_t i = 0; i < charts.size(); ++i)
    draw(svg, charts[i], kMargin + kAxis + step * static_cast<double>(i), x_title);
  double y = kTop + 8;
  for (const Line& line : charts.front().lines) {
    svg.polyline({{legend, y}, {legend + 26, y}}, line.color, 2, line.dashes);
    svg.text(legend + 32, y + 4, line.label, {.size = 12});
    y += 20;
  }
  return svg.finish();
}

}  // namespace tessera::bench
