#pragma once

#include <span>

#include "core/scene/settings.h"
#include "proto/wire/choice.h"

namespace tessera::proto {

// The words that a document and an answer share, in the order in which they are listed. Those of structures and their
// options stand in core/accel/accel_table.h.
std::span<const Choice<ScreenBounds>> screen_bounds_names();
std::span<const Choice<Aov>> aov_names();
std::span<const Choice<IntegratorKind>> integrator_names();
std::span<const Choice<SamplerKind>> sampler_names();
std::span<const Choice<FilterKind>> filter_names();

}  // namespace tessera::proto
