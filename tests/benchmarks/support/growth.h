#pragma once

#include "tests/benchmarks/support/report.h"

namespace tessera::bench {

/// How build time, memory and time per ray grow with the number of triangles, from a thousand to a million, of one
/// terrain: a table with fitted exponents, figures "growth", and the plot "growth".
void measure_growth(Report& report);

}  // namespace tessera::bench
