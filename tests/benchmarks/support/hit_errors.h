#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/accel/accel.h"
#include "tests/support/wide_oracle.h"

namespace tessera::bench {

/// What the oracle says of a ray, and how much rounding there may be in it.
struct TrueAnswer {
  WideAnswer answer;
  Wide reach = 0;            ///< The M of the culling contract: the distance to the farthest corner of the scene's box.
  bool is_boundary = false;  ///< An edge, a rim or a silhouette lies within the rounding of double.
};
std::vector<TrueAnswer> true_answers(const Scene& scene, const std::vector<Ray>& rays);

/// How a structure's answers differ from the true ones.
struct HitErrors {
  std::uint64_t rays = 0;
  std::uint64_t missed = 0;              ///< There is a hit, none was found.
  std::uint64_t invented = 0;            ///< There is none, one was found.
  std::uint64_t wrong_primitive = 0;     ///< Another is nearer by more than 2 ulp.
  std::uint64_t boundary = 0;            ///< Any of these where the true answer itself hangs on the rounding of double.
  double max_ulp = 0, mean_ulp = 0;      ///< |t − true t| in ulp(true t), where the primitive is right.
  double max_reach = 0, mean_reach = 0;  ///< The same distance as a share of M·2^-24.

  std::uint64_t wrong() const { return missed + invented + wrong_primitive; }
  bool operator==(const HitErrors&) const = default;
};
HitErrors hit_errors(const Accel& accel, const std::vector<Ray>& rays, const std::vector<TrueAnswer>& truth);

}  // namespace tessera::bench
