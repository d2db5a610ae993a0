#include "client/progress_bar.h"

#include <algorithm>
#include <cmath>

#include <sys/ioctl.h>
#include <unistd.h>

namespace tessera::client {
namespace {

constexpr std::size_t kBarWidth = 30;
constexpr std::size_t kColumnsWhenUnknown = 80;
constexpr const char* kEraseLine = "\r\033[K";

template <typename... Values>
std::string print(const char* format, Values... values) {
  char text[64];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

std::size_t columns_of(std::FILE* terminal) {
  winsize size{};
  const bool is_known = ioctl(fileno(terminal), TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return is_known ? size.ws_col : kColumnsWhenUnknown;
}

std::string bar(double fraction) {
  const auto done = static_cast<std::size_t>(fraction * kBarWidth);
  return '[' + std::string(done, '#') + std::string(kBarWidth - done, '.') + ']';
}

/// A line in a log: the state, and how far it is in steps that don't fill the log.
std::string coarse_line(const proto::JobStatus& status) {
  std::string line(proto::name(status.state));
  if (status.state == proto::JobState::rendering)
    line += print(" %2d%%", static_cast<int>(fraction_done(status) * 10) * 10);
  return line;
}

}  // namespace

std::string format_duration(double seconds) {
  if (seconds < 0.9995) return print("%.0f ms", seconds * 1e3);
  if (seconds < 59.95) return print("%.1f s", seconds);
  const auto whole = static_cast<long long>(std::min(std::round(seconds), 1e15));
  if (whole < 3600) return print("%lld min %02lld s", whole / 60, whole % 60);
  return print("%lld h %02lld min", whole / 3600, whole % 3600 / 60);
}

std::string format_quality(const proto::JobStatus& status) {
  if (!status.achieved) return "";
  const auto& [error, interval] = *status.achieved;
  return print(", %.4g samples a pixel", status.samples_per_pixel.mean) +
         print(", error %.3g (%.3g to %.3g)", error, interval.low, interval.high);
}

double fraction_done(const proto::JobStatus& status) {
  if (status.state == proto::JobState::completed) return 1;
  return std::min(1.0, status.progress);
}

std::string progress_line(const proto::JobStatus& status, std::optional<double> mrays_per_second, std::size_t columns) {
  const double fraction = fraction_done(status);
  std::string line = print("%-9s ", std::string(proto::name(status.state)).c_str());
  line += bar(fraction) + print(" %3d%%", static_cast<int>(fraction * 100));
  if (status.eta && !proto::has_ended(status.state)) line += "  ETA " + format_duration(*status.eta);
  if (mrays_per_second) line += print("  %.2f Mray/s", *mrays_per_second);
  return line.substr(0, columns);
}

ProgressBar::ProgressBar(std::FILE* out) : out_(out), is_on_terminal_(isatty(fileno(out)) != 0) {}

ProgressBar::~ProgressBar() {
  if (has_drawn_) std::fputc('\n', out_);
}

void ProgressBar::show(const proto::JobStatus& status, std::optional<double> mrays_per_second) {
  if (is_on_terminal_) {
    // A character short of the edge: some terminals wrap when the last column is written.
    draw_over(progress_line(status, mrays_per_second, columns_of(out_) - 1));
  } else if (const std::string line = coarse_line(status); line != last_line_) {
    std::fprintf(out_, "%s\n", line.c_str());
    std::fflush(out_);
    last_line_ = line;
  }
}

void ProgressBar::draw_over(const std::string& line) {
  std::fprintf(out_, "%s%s", kEraseLine, line.c_str());
  std::fflush(out_);
  has_drawn_ = true;
}

}  // namespace tessera::client
