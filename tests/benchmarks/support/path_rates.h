#pragma once

#include <filesystem>

#include "tests/benchmarks/support/light_renderers.h"
#include "tests/benchmarks/support/report.h"

namespace tessera::bench {

/// Mray/s of the path tracer on one thread over a scene, beside what the structure alone gives for as many rays of each
/// kind: camera rays by tiles, diffuse ones, and shadow rays to a point (`kernel_rays`). `folder` has the scene's
/// meshes, and `one_thread` renders it.
void measure_path_rates(Report& report, const LightScene& scene, const std::filesystem::path& folder,
                        Tessera& one_thread);

}  // namespace tessera::bench
