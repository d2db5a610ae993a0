#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "tests/benchmarks/support/embree_peer.h"
#include "tests/benchmarks/support/kernel_rays.h"
#include "tests/benchmarks/support/samples.h"

namespace tessera::bench {

/// A mesh as Embree builds it, in the order of `kEmbreeScenes`; empty without Embree.
using Peers = std::vector<std::unique_ptr<EmbreeScene>>;
Peers build_peers(const TriangleMesh& mesh);

/// Rays for which a peer's answer isn't ours.
struct Disagreement {
  std::size_t hit_or_miss = 0;
  std::size_t t = 0;  ///< By more than 10^-4 of it.
};

/// What tracing one set of rays measured, by threads: [0] one, [1] two; nothing where it wasn't asked for.
struct Race {
  struct Peer {
    EmbreeMode mode;
    double calibrated_mrays = 0;         ///< On one thread, once, over a part of the rays.
    std::array<Samples, 2> mrays{};      ///< Of the fastest three.
    std::array<Samples, 2> our_ratio{};  ///< Ours over theirs, repetition by repetition.
  };
  std::string rays;
  std::size_t count = 0;
  std::array<Samples, 2> mrays;
  std::vector<Peer> peers;  ///< The fastest in calibration first.
  Disagreement from_default, from_robust;

  /// The peer with the highest median on so many threads; null without one.
  const Peer* best(int threads) const;
  /// What the best mode in such scenes reaches on one thread: its median, or what calibration found when it isn't
  /// among the fastest three. 0 without one.
  double mrays_in(EmbreeScenes scenes) const;
};

struct RaceOptions {
  int repetitions = 5;
  std::vector<int> threads = {1, 2};
};

/// Traces the rays with ours and with each of Embree's three fastest modes, in turns. Every repetition packs Embree's
/// rays afresh, before its clock starts.
Race race(const Accel& ours, const Peers& peers, const RaySet& set, const RaceOptions& options);

}  // namespace tessera::bench
