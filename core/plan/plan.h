#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/plan/accel_costs.h"
#include "core/plan/features.h"
#include "core/scene/scene.h"
#include "core/scene/settings.h"
#include "core/screen/tiling.h"

namespace tessera {

/// Something that the plan leaves out because the scene doesn't need it.
struct Skip {
  std::string what;     ///< A stable name, e.g. "shadow_rays".
  std::string because;  ///< A sentence.
  std::uint64_t count;  ///< How many are left out; what is counted is said in `because`.
};

/// What will be done to render a scene, and why: a pure function of scene, camera and settings.
struct Plan {
  Features features;
  IntegratorKind integrator = IntegratorKind::whitted;  ///< Never `automatic`.
  std::string integrator_because;
  SamplerKind sampler = SamplerKind::grid;  ///< Never `automatic`.
  std::uint32_t max_depth = 1;
  AccelOptions accel;  ///< Its kind is never `automatic`.
  std::string accel_because;
  std::vector<AccelEstimate> candidates;  ///< What each structure would cost, the cheapest first.
  std::uint64_t primitives = 0;
  Tiling tiling;
  std::vector<Skip> skips;
};

/// Whether any tile traces a ray; without one, no structure has to be built.
bool needs_structure(const Plan& plan);

/// Whether a path is traced, or its background looked up by direction, in a scene with any light; without that, no
/// table of lights has to be built.
bool needs_lights(const Plan& plan);

Plan make_plan(const Scene& scene, const Camera& camera, const Settings& settings);

}  // namespace tessera
