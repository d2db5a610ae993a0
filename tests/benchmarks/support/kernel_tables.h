#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/benchmarks/support/kernel_build.h"
#include "tests/benchmarks/support/kernel_leaks.h"
#include "tests/benchmarks/support/kernel_race.h"
#include "tests/benchmarks/support/report.h"

namespace tessera::bench {

/// What was measured over one scene.
struct SceneFigures {
  std::string scene;
  std::size_t triangles = 0;
  std::string structure;  ///< Ours.
  std::vector<Race> races;
  std::optional<BuildRace> builds;
};

/// Tables on the terminal.
void print(const SceneFigures& figures, const std::vector<int>& threads);
void print(const std::vector<LeakCount>& leaks);

/// The figures, and the bars: ours over the best mode of Embree for each kind of rays, for building and for bytes.
/// Without Embree there are no bars but that of the leaks.
void report(const SceneFigures& figures, const std::vector<int>& threads, Report& to);
void report(const std::vector<LeakCount>& leaks, Report& to);

/// Speeds by kind of rays and number of threads.
std::string speed_chart(const SceneFigures& figures, const std::vector<int>& threads);

}  // namespace tessera::bench
