#include "tests/benchmarks/support/kernel_race.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "tests/benchmarks/support/kernel_clock.h"
#include "tests/benchmarks/support/our_rays.h"

namespace tessera::bench {
namespace {

constexpr std::size_t kFinalists = 3, kCalibrationStride = 5;

/// Theirs: packets of one width, those of each half on their own.
class TheirRays {
 public:
  TheirRays(const RaySet& set, int width) : set_(set) {
    for (auto& half : halves_) half = make_embree_rays(width, is_any_hit(set.query));
  }

  double mrays(const EmbreeScene& scene, bool coherent, int threads) {
    for (std::size_t i = 0; i < 2; ++i) {
      const RaySet::Range range = set_.half(static_cast<int>(i));
      halves_[i]->pack(std::span(set_.rays).subspan(range.begin, range.end - range.begin));
    }
    const double seconds =
        seconds_of_halves(threads, [&](int half) { halves_[static_cast<std::size_t>(half)]->trace(scene, coherent); });
    return 1e-6 * static_cast<double>(set_.rays.size()) / seconds;
  }

  std::vector<float> answers() const {
    std::vector<float> t(set_.rays.size());
    const std::size_t middle = set_.half(0).end;
    halves_[0]->answers(std::span(t).first(middle));
    halves_[1]->answers(std::span(t).subspan(middle));
    return t;
  }

 private:
  const RaySet& set_;
  std::array<std::unique_ptr<EmbreeRays>, 2> halves_;
};

const EmbreeScene& scene_of(const Peers& peers, EmbreeScenes scenes) {
  return *peers[static_cast<std::size_t>(scenes)];
}

/// All modes, the fastest first.
std::vector<Race::Peer> calibrate(const Peers& peers, const RaySet& set) {
  const RaySet part = part_of(set, kCalibrationStride);
  std::vector<Race::Peer> modes;
  for (const EmbreeMode& mode : embree_modes()) {
    const EmbreeScene& scene = scene_of(peers, mode.scenes);
    // From packets of shadow rays among instances, told to be coherent, Embree 3.13 doesn't come back.
    if (mode.coherent && is_any_hit(set.query) && scene.has_instances()) continue;
    TheirRays rays(part, mode.width);
    const double first = rays.mrays(scene, mode.coherent, 1);
    modes.push_back({mode, std::max(first, rays.mrays(scene, mode.coherent, 1))});
  }
  std::ranges::sort(modes, std::ranges::greater(), &Race::Peer::calibrated_mrays);
  return modes;
}

Disagreement compare(const std::vector<float>& ours, const std::vector<float>& theirs) {
  Disagreement out;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    if ((ours[i] < kInfinity) != (theirs[i] < kInfinity))
      ++out.hit_or_miss;
    else if (ours[i] < kInfinity && std::abs(ours[i] - theirs[i]) > 1e-4F * ours[i])
      ++out.t;
  }
  return out;
}

}  // namespace

Peers build_peers(const TriangleMesh& mesh) {
  Peers peers;
  for (const EmbreeScenes scenes : kEmbreeScenes)
    if (const auto build = prepare_embree(mesh, scenes, 2)) peers.push_back(build->build());
  return peers;
}

const Race::Peer* Race::best(int threads) const {
  const auto i = static_cast<std::size_t>(threads - 1);
  const Peer* best = nullptr;
  for (const Peer& peer : peers)
    if (!peer.mrays[i].empty() && (!best || peer.mrays[i].median() > best->mrays[i].median())) best = &peer;
  return best;
}

double Race::mrays_in(EmbreeScenes scenes) const {
  const auto at = std::ranges::find(peers, scenes, [](const Peer& peer) { return peer.mode.scenes; });
  if (at == peers.end()) return 0;
  return at->mrays[0].empty() ? at->calibrated_mrays : at->mrays[0].median();
}

Race race(const Accel& accel, const Peers& peers, const RaySet& set, const RaceOptions& options) {
  Race out;
  out.rays = set.name;
  out.count = set.rays.size();
  if (set.rays.empty()) return out;
  OurRays ours(accel, set);
  ours.mrays(1);  // warms up, and gives the answers to compare
  if (!peers.empty()) {
    out.peers = calibrate(peers, set);
    TheirRays single(set, 1);
    single.mrays(scene_of(peers, EmbreeScenes::normal), false, 1);
    out.from_default = compare(ours.answers(), single.answers());
    single.mrays(scene_of(peers, EmbreeScenes::robust), false, 1);
    out.from_robust = compare(ours.answers(), single.answers());
  }
  const std::size_t finalists = std::min(kFinalists, out.peers.size());
  std::vector<TheirRays> theirs;
  for (std::size_t i = 0; i < finalists; ++i) theirs.emplace_back(set, out.peers[i].mode.width);
  for (int repetition = 0; repetition < options.repetitions; ++repetition)
    for (const int threads : options.threads) {
      const auto t = static_cast<std::size_t>(threads - 1);
      out.mrays[t].add(ours.mrays(threads));
      for (std::size_t i = 0; i < finalists; ++i) {
        Race::Peer& peer = out.peers[i];
        peer.mrays[t].add(theirs[i].mrays(scene_of(peers, peer.mode.scenes), peer.mode.coherent, threads));
        peer.our_ratio[t].add(out.mrays[t].last() / peer.mrays[t].last());
      }
    }
  return out;
}

}  // namespace tessera::bench
