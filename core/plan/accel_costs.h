#pragma once

#include <vector>

#include "core/scene/accel_options.h"
#include "core/scene/scene.h"

namespace tessera {

/// What a structure is expected to cost for a scene and a number of rays, on one thread.
struct AccelEstimate {
  AccelOptions options;
  double build_seconds;
  double trace_seconds;

  double total_seconds() const { return build_seconds + trace_seconds; }
};

/// Every kind with its default options, hierarchies and lists over each bound: the cheapest first. Pure: from counts,
/// sizes and spread of what is in the scene, in time linear in its objects. The constants were fitted once to the
/// figures of `tests/bench structures`, of all its scenes together; the absolute seconds are of that machine, and only
/// their ratios count.
std::vector<AccelEstimate> estimate_accels(const Scene& scene, double rays);

}  // namespace tessera
