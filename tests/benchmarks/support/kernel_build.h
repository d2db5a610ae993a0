#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <string>

#include "core/scene/accel_options.h"
#include "tests/benchmarks/support/kernel_race.h"
#include "tests/benchmarks/support/kernel_scenes.h"

namespace tessera::bench {

/// What building one mesh measured.
struct BuildRace {
  struct Side {
    std::array<Samples, 2> mtris{};  ///< Million triangles a second on one thread and on two.
    std::size_t bytes = 0;           ///< Of what is built, the mesh's own arrays not counted.
  };
  Side ours;
  /// Embree's builds: "medium", its default, and "high", with spatial splits; of "compact" and "robust" the bytes
  /// alone. Empty without Embree.
  std::map<std::string, Side> peers;

  /// Ours over theirs, of the medians; 0 where either wasn't measured.
  double our_ratio(const std::string& peer, int threads) const;
};

/// Builds in turns. One thread: processor time, ours kept to one processor however many threads it starts. Two: seconds
/// on the clock, ours kept to two. What takes longer than two seconds isn't repeated.
BuildRace race_builds(const KernelScene& scene, const AccelOptions& accel, const RaceOptions& options);

}  // namespace tessera::bench
