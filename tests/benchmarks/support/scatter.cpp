#include "tests/benchmarks/support/scatter.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "tests/benchmarks/support/svg.h"

namespace tessera::bench {
namespace {

constexpr std::size_t kColumns = 4;
constexpr double kMargin = 28, kTop = 112, kAxis = 44, kWidth = 230, kHeight = 170, kHead = 40, kFoot = 76, kGap = 22;

/// The axis over all values of the panels, `headroom` times beyond the greatest.
LogAxis axis_over(std::span<const ScatterPanel> panels, double Dot::*coordinate, double headroom, double from,
                  double to) {
  double lo = HUGE_VAL, hi = 0;
  for (const ScatterPanel& panel : panels)
    for (const Dot& dot : panel.dots) {
      lo = std::min(lo, dot.*coordinate);
      hi = std::max(hi, dot.*coordinate);
    }
  return hi > 0 ? LogAxis(lo, hi * headroom, from, to) : LogAxis(1, 10, from, to);
}

void draw(Svg& svg, const ScatterPanel& panel, double x, double y, const LogAxis& errors) {
  const LogAxis times = axis_over({&panel, 1}, &Dot::x, 1, 0, kWidth);
  const double left = x + kAxis, top = y + kHead;
  svg.text(x, y + 12, panel.title, {.size = 14, .bold = true});
  svg.text(x, y + 28, panel.subtitle, {.size = 10, .color = "#666"});
  for (const double t : times.decades()) {
    svg.line(left + times.at(t), top, left + times.at(t), top + kHeight, "#e8e8e8");
    svg.text(left + times.at(t), top + kHeight + 14, short_time(t), {.size = 9, .anchor = "middle", .color = "#666"});
  }
  const auto decades = errors.decades();
  for (std::size_t i = 0; i < decades.size(); ++i) {
    svg.line(left, top + errors.at(decades[i]), left + kWidth, top + errors.at(decades[i]), "#e8e8e8");
    if (decades.size() <= 8 || i % 2 == 0)
      svg.text(left - 5, top + errors.at(decades[i]) + 3, power_of_ten_text(decades[i]),
               {.size = 9, .anchor = "end", .color = "#666"});
  }
  for (const Dot& dot : panel.dots) {
    const double cx = left + times.at(dot.x), cy = top + errors.at(dot.y);
    if (dot.is_contrast)
      svg.circle(cx, cy, 5, "none", dot.color);
    else
      svg.circle(cx, cy, 4.5, dot.color);
    if (!dot.label.empty()) svg.text(cx, cy - 9, dot.label, {.size = 10, .anchor = "middle"});
  }
  for (std::size_t i = 0; i < panel.notes.size(); ++i)
    svg.text(x, top + kHeight + 34 + 15 * static_cast<double>(i), panel.notes[i], {.size = 11});
}

}  // namespace

std::string scatter_chart(const std::string& title, const std::string& subtitle, const std::string& y_title,
                          const std::vector<LegendEntry>& legend, const std::vector<ScatterPanel>& panels) {
  const LogAxis errors = axis_over(panels, &Dot::y, 3, kHeight, 0);  // room for a label above the worst
  const double step_x = kAxis + kWidth + kGap, step_y = kHead + kHeight + kFoot;
  const std::size_t rows = (panels.size() + kColumns - 1) / kColumns;
  Svg svg(2 * kMargin + step_x * kColumns - kGap, kTop + step_y * static_cast<double>(rows));
  svg.text(kMargin, 34, title, {.size = 20, .bold = true});
  svg.text(kMargin, 56, subtitle, {.size = 12, .color = "#555"});
  double x = kMargin;
  for (const LegendEntry& entry : legend) {
    svg.circle(x + 6, 76, 5, entry.color);
    svg.text(x + 16, 80, entry.label, {.size = 12});
    x += 40 + 7.5 * static_cast<double>(entry.label.size());
  }
  svg.text(kMargin, 100, y_title, {.size = 11, .color = "#555"});
  for (std::size_t i = 0; i < panels.size(); ++i)
    draw(svg, panels[i], kMargin + step_x * static_cast<double>(i % kColumns),
         kTop + step_y * static_cast<double>(i / kColumns), errors);
  return svg.finish();
}

}  // namespace tessera::bench
