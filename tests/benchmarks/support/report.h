#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/benchmarks/support/samples.h"

namespace tessera::bench {

/// What a benchmark leaves behind: tables and bar lines on the terminal, <name>.json and plots in a folder.
class Report {
 public:
  /// The folder is made when it isn't there. The machine and the compiler are noted at once.
  Report(std::string name, std::filesystem::path folder);

  /// The figures, free in form; "bars" and "machine" are the report's own.
  nlohmann::json& figures() { return figures_; }

  /// A bar that an issue set.
  void at_least(const std::string& bar, double value, double bound) { add_bar(bar, value, bound, value >= bound); }
  void at_most(const std::string& bar, double value, double bound) { add_bar(bar, value, bound, value <= bound); }

  /// <name>.svg; a benchmark's further plots are <name>-<part>.svg.
  void write_plot(const std::string& svg, const std::string& part = "") const;

  /// Writes the JSON and prints the bars, one a line: `bar <name> <value> <bound> ok|short`.
  void finish();

 private:
  void add_bar(const std::string& bar, double value, double bound, bool ok);

  std::string name_;
  std::filesystem::path folder_;
  nlohmann::json figures_ = nlohmann::json::object();
  std::vector<std::string> bars_;
};

/// Rows of cells, columns as wide as they need, the first one left-aligned.
void print_table(const std::vector<std::vector<std::string>>& rows);

std::string fixed(double value, int digits);
/// With so many decimals that about three digits count.
std::string three_digits(double value);
/// "12.3 ±4%", "-" without samples.
std::string with_spread(const Samples& samples, int digits);
/// The same with `three_digits`.
std::string with_spread(const Samples& samples);

}  // namespace tessera::bench
