#pragma once

#include <array>
#include <string>
#include <vector>

namespace tessera::bench {

/// Okabe & Ito's colours and a grey, told apart by everyone.
inline constexpr std::array kColors = {"#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#888888"};

/// An SVG document on white, put together element by element. Lengths are pixels, y runs down.
class Svg {
 public:
  Svg(double width, double height);

  struct Font {
    double size = 11;
    std::string anchor = "start";  ///< Or "middle", "end".
    std::string color = "#222";
    bool bold = false;
  };
  void text(double x, double y, const std::string& words) { text(x, y, words, Font()); }
  void text(double x, double y, const std::string& words, const Font& font);
  void line(double x0, double y0, double x1, double y1, const std::string& color, double width = 1);
  /// `dashes` as SVG's stroke-dasharray; none by default.
  void polyline(const std::vector<std::array<double, 2>>& points, const std::string& color, double width,
                const std::string& dashes = "none");
  void rectangle(double x, double y, double width, double height, const std::string& color);
  void circle(double x, double y, double radius, const std::string& fill, const std::string& stroke = "white");

  /// The whole document.
  std::string finish() const { return body_ + "</svg>\n"; }

 private:
  std::string body_;
};

/// Maps [lo, hi] to pixels logarithmically; whole decades, at least one.
class LogAxis {
 public:
  /// The decades that hold [lo, hi], with a hair's overhang; `from` and `to` are the pixels of the ends.
  /// Precondition: lo > 0.
  LogAxis(double lo, double hi, double from, double to);

  double at(double value) const;
  /// Powers of ten within the axis.
  std::vector<double> decades() const;

 private:
  double lo_, hi_;  ///< Decimal logarithms.
  double from_, to_;
};

/// "850 µs", "12 ms", "1.3 s": three digits at most.
std::string short_time(double seconds);
/// "640 B", "1.2 MB"
std::string short_bytes(double bytes);

/// A power of ten from 10^-9 to 10^9: "0.01", "1000", "10⁴".
std::string power_of_ten_text(double power_of_ten);

}  // namespace tessera::bench
