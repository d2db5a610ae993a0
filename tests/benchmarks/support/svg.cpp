#include "tests/benchmarks/support/svg.h"

#include <algorithm>
#include <cmath>

#include "tests/benchmarks/support/report.h"

namespace tessera::bench {
namespace {

std::string escaped(const std::string& words) {
  std::string out;
  for (const char c : words) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else
      out += c;
  }
  return out;
}

std::string attribute(const char* name, double value) { return std::string(" ") + name + "='" + fixed(value, 1) + "'"; }
std::string attribute(const char* name, const std::string& value) {
  return std::string(" ") + name + "='" + value + "'";
}

/// Two digits, or three in front of the point, and a unit of a thousand times the one before.
std::string with_unit(double value, double smallest, const std::vector<std::string>& units) {
  std::size_t unit = 0;
  value /= smallest;
  while (value >= 999.5 && unit + 1 < units.size()) {
    value /= 1000;
    ++unit;
  }
  return fixed(value, value < 9.95 && unit > 0 ? 1 : 0) + " " + units[unit];
}

/// Values this little beyond a decade, in decades, don't ask for another one.
constexpr double kOverhang = 0.02;

}  // namespace

Svg::Svg(double width, double height)
    : body_("<svg xmlns='http://www.w3.org/2000/svg'" + attribute("width", width) + attribute("height", height) +
            " font-family='Helvetica, Arial, DejaVu Sans, sans-serif'>\n") {
  rectangle(0, 0, width, height, "white");
}

void Svg::text(double x, double y, const std::string& words, const Font& font) {
  body_ += "<text" + attribute("x", x) + attribute("y", y) + attribute("font-size", font.size) +
           attribute("text-anchor", font.anchor) + attribute("fill", font.color) +
           (font.bold ? " font-weight='bold'>" : ">") + escaped(words) + "</text>\n";
}

void Svg::line(double x0, double y0, double x1, double y1, const std::string& color, double width) {
  polyline({{x0, y0}, {x1, y1}}, color, width);
}

void Svg::polyline(const std::vector<std::array<double, 2>>& points, const std::string& color, double width,
                   const std::string& dashes) {
  body_ += "<polyline fill='none'" + attribute("stroke", color) + attribute("stroke-width", width) +
           attribute("stroke-dasharray", dashes) + " stroke-linejoin='round' points='";
  for (const auto& [x, y] : points) body_ += fixed(x, 1) + "," + fixed(y, 1) + " ";
  body_ += "'/>\n";
}

void Svg::rectangle(double x, double y, double width, double height, const std::string& color) {
  body_ += "<rect" + attribute("x", x) + attribute("y", y) + attribute("width", width) + attribute("height", height) +
           attribute("fill", color) + "/>\n";
}

void Svg::circle(double x, double y, double radius, const std::string& fill, const std::string& stroke) {
  body_ += "<circle" + attribute("cx", x) + attribute("cy", y) + attribute("r", radius) + attribute("fill", fill) +
           attribute("stroke", stroke) + "/>\n";
}

LogAxis::LogAxis(double lo, double hi, double from, double to)
    : lo_(std::floor(std::log10(lo) + kOverhang)),
      hi_(std::max(std::ceil(std::log10(hi) - kOverhang), lo_ + 1)),
      from_(from),
      to_(to) {}

double LogAxis::at(double value) const { return std::lerp(from_, to_, (std::log10(value) - lo_) / (hi_ - lo_)); }

std::vector<double> LogAxis::decades() const {
  std::vector<double> out;
  for (double power = lo_; power <= hi_; ++power) out.push_back(std::pow(10, power));
  return out;
}

std::string short_time(double seconds) { return with_unit(seconds, 1e-9, {"ns", "µs", "ms", "s"}); }

std::string short_bytes(double bytes) { return with_unit(bytes, 1, {"B", "kB", "MB", "GB"}); }

std::string power_of_ten_text(double power_of_ten) {
  static constexpr std::array kDigits = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  const auto exponent = std::lround(std::log10(power_of_ten));
  if (exponent > 3) return std::string("10") + kDigits[static_cast<std::size_t>(exponent)];
  return fixed(power_of_ten, static_cast<int>(std::max(0L, -exponent)));
}

}  // namespace tessera::bench
