#pragma once

#include <filesystem>

#include "tests/benchmarks/support/light_renderers.h"
#include "tests/benchmarks/support/report.h"

namespace tessera::bench {

/// What many emitters cost and what the light hierarchy gains. Seconds a sample under 100,000 of them against those
/// under one quad, by whole renders. And direct light at what the camera sees first, its lights picked by the light
/// table and, in the same loop, each as likely as any other: error at equal time. `folder` has the scenes' meshes.
void measure_many_lights(Report& report, const std::filesystem::path& folder, Tessera& tessera);

}  // namespace tessera::bench
