#include "tests/benchmarks/support/panels.h"

#include <algorithm>

#include "tests/benchmarks/support/svg.h"

namespace tessera::bench {
namespace {

constexpr std::size_t kColumns = 3;
constexpr double kMargin = 28, kTop = 104, kLabels = 92, kBars = 250, kValue = 56, kBarStep = 15, kBarHeight = 11;
constexpr double kPanelHead = 44, kPanelFoot = 34, kGap = 26, kPanelWidth = kLabels + kBars + kValue;

double panel_height(const Panel& panel) {
  return kPanelHead + kBarStep * static_cast<double>(panel.bars.size()) + kPanelFoot;
}

void draw(Svg& svg, const Panel& panel, double x, double y) {
  svg.text(x, y + 14, panel.title, {.size = 14, .bold = true});
  svg.text(x, y + 31, panel.subtitle, {.size = 11, .color = "#666"});
  if (panel.bars.empty()) return;
  const auto [least, most] = std::ranges::minmax(panel.bars, {}, &PanelBar::seconds);
  const double left = x + kLabels, top = y + kPanelHead;
  const double bottom = top + kBarStep * static_cast<double>(panel.bars.size());
  // A third of the best bar, so that it has some length of its own.
  const LogAxis axis(least.seconds / 3, most.seconds, left, left + kBars);
  for (const double decade : axis.decades()) {
    svg.line(axis.at(decade), top - 2, axis.at(decade), bottom, "#e2e2e2");
    svg.text(axis.at(decade), bottom + 14, short_time(decade), {.size = 10, .anchor = "middle", .color = "#666"});
  }
  double row = top;
  for (const PanelBar& bar : panel.bars) {
    const double base = row + kBarHeight - 2;
    svg.text(left - 6, base, (bar.is_marked ? "▸ " : "") + bar.label,
             {.size = 11, .anchor = "end", .bold = bar.is_marked});
    svg.rectangle(left, row, axis.at(bar.seconds) - left, kBarHeight, bar.color);
    const double first = std::max(axis.at(std::max(bar.first_seconds, 1e-12)), left);
    svg.rectangle(first - 1, row - 1, 2, kBarHeight + 2, "#222");
    svg.text(axis.at(bar.seconds) + 5, base, short_time(bar.seconds),
             {.size = 10, .color = "#222", .bold = bar.is_marked});
    row += kBarStep;
  }
}

}  // namespace

std::string panel_chart(const std::string& title, const std::string& subtitle, const std::vector<LegendEntry>& legend,
                        const std::vector<Panel>& panels) {
  std::vector<double> row_tops = {kTop};
  for (std::size_t i = 0; i < panels.size(); i += kColumns) {
    double tallest = 0;
    for (std::size_t j = i; j < std::min(i + kColumns, panels.size()); ++j)
      tallest = std::max(tallest, panel_height(panels[j]));
    row_tops.push_back(row_tops.back() + tallest);
  }
  Svg svg(2 * kMargin + kColumns * kPanelWidth + (kColumns - 1) * kGap, row_tops.back() + 10);
  svg.text(kMargin, 34, title, {.size = 20, .bold = true});
  svg.text(kMargin, 56, subtitle, {.size = 12, .color = "#555"});
  double x = kMargin;
  for (const LegendEntry& entry : legend) {
    svg.rectangle(x, 70, 12, 12, entry.color);
    svg.text(x + 17, 80, entry.label, {.size = 12});
    x += 40 + 7.5 * static_cast<double>(entry.label.size());
  }
  for (std::size_t i = 0; i < panels.size(); ++i)
    draw(svg, panels[i], kMargin + static_cast<double>(i % kColumns) * (kPanelWidth + kGap), row_tops[i / kColumns]);
  return svg.finish();
}

}  // namespace tessera::bench
