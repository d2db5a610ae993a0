#pragma once

#include <vector>

#include "tests/benchmarks/support/kernel_clock.h"
#include "tests/benchmarks/support/kernel_rays.h"

namespace tessera::bench {

/// A set of rays traced by a structure of ours: one batched call for each batch of the set. Both outlive it.
class OurRays {
 public:
  OurRays(const Accel& accel, const RaySet& set) : accel_(accel), set_(set) {
    if (is_any_hit(set.query))
      hidden_.resize(set.rays.size());
    else
      hits_.resize(set.rays.size());
  }

  /// Million rays a second of processor time.
  double mrays(int threads) {
    const double seconds = seconds_of_halves(threads, [&](int half) { trace(half); });
    return 1e-6 * static_cast<double>(set_.rays.size()) / seconds;
  }

  /// Each ray's t, infinite for a miss; what hides is at 0.
  std::vector<float> answers() const {
    std::vector<float> t;
    for (const Hit& hit : hits_) t.push_back(hit.t);
    for (const std::uint8_t hidden : hidden_) t.push_back(hidden ? 0 : kInfinity);
    return t;
  }

 private:
  void trace(int half) {
    const std::span rays(set_.rays);
    const std::span hits(hits_);
    const std::span hidden(hidden_);
    set_.each_batch(half, [&](std::size_t begin, std::size_t end) {
      const std::size_t n = end - begin;
      switch (set_.query) {
        case Query::closest_fan:
          return accel_.closest_fan(RayFan(rays.front().origin, set_.directions).part(begin, n),
                                    hits.subspan(begin, n));
        case Query::occluded_fan:
          return accel_.occluded_fan(set_.apex, rays.subspan(begin, n), hidden.subspan(begin, n));
        case Query::closest:
          return accel_.closest(rays.subspan(begin, n), hits.subspan(begin, n));
        case Query::occluded:
          return accel_.occluded(rays.subspan(begin, n), hidden.subspan(begin, n));
      }
    });
  }

  const Accel& accel_;
  const RaySet& set_;
  std::vector<Hit> hits_;
  std::vector<std::uint8_t> hidden_;
};

}  // namespace tessera::bench
