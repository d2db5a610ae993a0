#pragma once

#include <cstdint>
#include <filesystem>

#include "tests/benchmarks/support/report.h"

namespace tessera::bench {

/// Where the time of one job goes, for a scene document in a file and 1024 × 1024 pixels. Prints tables and adds bars
/// named after `job`:
///
/// - the steps of a cold job at a daemon on two threads, one after the other;
/// - two threads against one, over all that the daemon does for the job once its scene is parsed;
/// - what handing out tiles, storing and reading their pixels takes, as a share of the job's processor time;
/// - how long the job's tiles would take on 1 to 64 cores, by their processor times measured one by one.
///
/// Throws std::runtime_error when the daemon doesn't start or refuses.
void measure_job_costs(Report& report, const std::string& job, const std::filesystem::path& scene,
                       std::uint32_t samples, const std::filesystem::path& tesserad);

}  // namespace tessera::bench
