#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/accel/accel.h"

namespace tessera::bench {

/// Rays from inside a closed mesh that hit nothing.
struct LeakCount {
  std::string mesh, aimed_at;
  std::size_t rays = 0;
  std::size_t ours = 0;  ///< Lost by any of the batched calls that rays from one point can be handed to.
  std::optional<std::size_t> embree_default, embree_robust;  ///< One ray a call; nothing without Embree.
};

/// From six points inside, at every vertex and at the middle of every edge of an icosphere of 20k triangles and of
/// the organic body of 100k.
std::vector<LeakCount> count_leaks(const AccelOptions& accel);

}  // namespace tessera::bench
