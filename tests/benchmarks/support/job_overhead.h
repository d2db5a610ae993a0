#pragma once

#include <filesystem>

#include "tests/benchmarks/support/samples.h"

namespace tessera::bench {

/// Milliseconds of a 64 × 64 job at a real daemon, beyond what tracing the same image takes in this process on as
/// many threads. The scene is known to the daemon and its structure built, and each call has a connection of its
/// own, as with curl.
struct JobOverhead {
  Samples tracing;    ///< The image alone, in this process.
  Samples completed;  ///< From submitting the job until its status says completed, less the tracing.
  Samples fetched;    ///< Until its PNG is here as well, less the tracing.
};

/// Throws when the daemon doesn't start or a call fails.
JobOverhead measure_job_overhead(const std::filesystem::path& tesserad);

}  // namespace tessera::bench
