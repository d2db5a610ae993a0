#include "tests/benchmarks/support/kernel_build.h"

#include "tests/benchmarks/support/kernel_clock.h"

namespace tessera::bench {
namespace {

constexpr double kSlowSeconds = 2;

/// Adds what `build` reaches, unless it was slow the last time.
template <typename Build>
void measure(const KernelScene& scene, int threads, BuildRace::Side& side, Build&& build) {
  Samples& mtris = side.mtris[static_cast<std::size_t>(threads - 1)];
  const double millions = 1e-6 * static_cast<double>(scene.triangles());
  if (!mtris.empty() && millions / mtris.last() > kSlowSeconds) return;
  const CpuStopwatch processor_time;
  const Stopwatch clock;
  const auto built = build();
  mtris.add(millions / (threads == 1 ? processor_time.seconds() : clock.seconds()));
}

void measure_ours(const KernelScene& scene, const AccelOptions& accel, int threads, BuildRace::Side& side) {
  const OnProcessors some(threads);
  measure(scene, threads, side, [&] {
    auto built = make_accel(scene.scene, accel);
    side.bytes = built->stats().bytes;
    return built;
  });
}

void measure_theirs(const KernelScene& scene, EmbreeScenes scenes, int threads, BuildRace::Side& side) {
  const auto prepared = prepare_embree(scene.mesh(), scenes, threads);
  measure(scene, threads, side, [&] {
    auto built = prepared->build();
    side.bytes = built->bytes();
    return built;
  });
}

}  // namespace

double BuildRace::our_ratio(const std::string& peer, int threads) const {
  const auto t = static_cast<std::size_t>(threads - 1);
  const auto at = peers.find(peer);
  if (at == peers.end() || ours.mtris[t].empty() || at->second.mtris[t].empty()) return 0;
  return ours.mtris[t].median() / at->second.mtris[t].median();
}

BuildRace race_builds(const KernelScene& scene, const AccelOptions& accel, const RaceOptions& options) {
  BuildRace out;
  const bool has_peer = !embree_modes().empty();
  for (int repetition = 0; repetition < options.repetitions; ++repetition)
    for (const int threads : options.threads) {
      measure_ours(scene, accel, threads, out.ours);
      if (!has_peer) continue;
      measure_theirs(scene, EmbreeScenes::normal, threads, out.peers["medium"]);
      measure_theirs(scene, EmbreeScenes::high, threads, out.peers["high"]);
    }
  if (has_peer) {
    out.peers["robust"].bytes = prepare_embree(scene.mesh(), EmbreeScenes::robust, 2)->build()->bytes();
    out.peers["compact"].bytes = prepare_embree(scene.mesh(), EmbreeScenes::compact, 2)->build()->bytes();
  }
  return out;
}

}  // namespace tessera::bench
