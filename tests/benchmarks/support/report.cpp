#include "tests/benchmarks/support/report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <thread>

namespace tessera::bench {
namespace {

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

/// How busy the machine is: figures taken beside other work say little.
double load_average() {
  double load = 0;
  std::ifstream("/proc/loadavg") >> load;
  return load;
}

}  // namespace

Report::Report(std::string name, std::filesystem::path folder) : name_(std::move(name)), folder_(std::move(folder)) {
  std::filesystem::create_directories(folder_);
  const double load = load_average();
  figures_["benchmark"] = name_;
  figures_["bars"] = nlohmann::json::array();
  figures_["machine"] = {{"processor", processor()},
                         {"cores", std::thread::hardware_concurrency()},
                         {"compiler", "g++ " __VERSION__},
                         {"load_average_before", load}};
  std::printf("%s, %u cores, g++ %s\n", processor().c_str(), std::thread::hardware_concurrency(), __VERSION__);
  if (load > 0.5) std::printf("The machine is busy with other work (load average %.1f): expect worse figures.\n", load);
}

void Report::add_bar(const std::string& bar, double value, double bound, bool ok) {
  figures_["bars"].push_back({{"name", bar}, {"value", value}, {"bound", bound}, {"ok", ok}});
  bars_.push_back("bar " + bar + " " + fixed(value, 3) + " " + fixed(bound, 3) + (ok ? " ok" : " short"));
}

void Report::write_plot(const std::string& svg, const std::string& part) const {
  const auto path = folder_ / (name_ + (part.empty() ? "" : "-" + part) + ".svg");
  std::ofstream(path) << svg;
  std::printf("plot %s\n", path.c_str());
}

void Report::finish() {
  const auto path = folder_ / (name_ + ".json");
  std::ofstream(path) << figures_.dump(1) << '\n';
  std::printf("json %s\n", path.c_str());
  for (const std::string& bar : bars_) std::printf("%s\n", bar.c_str());
}

void print_table(const std::vector<std::vector<std::string>>& rows) {
  // "±" is two bytes and one column.
  const auto columns = [](const std::string& cell) {
    return std::ranges::count_if(cell, [](char c) { return (c & 0xC0) != 0x80; });
  };
  std::vector<std::ptrdiff_t> widths;
  for (const auto& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths.resize(std::max(widths.size(), row.size()));
      widths[i] = std::max(widths[i], columns(row[i]));
    }
  std::printf("\n");
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string gap(static_cast<std::size_t>(widths[i] - columns(row[i])), ' ');
      line += i == 0 ? row[i] + gap : "  " + gap + row[i];
    }
    std::printf("%s\n", line.c_str());
  }
  std::fflush(stdout);
}

std::string fixed(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string with_spread(const Samples& samples, int digits) {
  if (samples.empty()) return "-";
  return fixed(samples.median(), digits) + " ±" + fixed(100 * samples.spread(), 0) + "%";
}

std::string three_digits(double value) {
  const double magnitude = value == 0 ? 0 : std::floor(std::log10(std::abs(value)));
  return fixed(value, static_cast<int>(std::clamp(2 - magnitude, 0.0, 9.0)));
}

std::string with_spread(const Samples& samples) {
  if (samples.empty()) return "-";
  return three_digits(samples.median()) + " ±" + fixed(100 * samples.spread(), 0) + "%";
}

}  // namespace tessera::bench
