#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/film/pass.h"
#include "core/film/sums.h"

namespace tessera {

/// An image's error, as its own samples tell it: the square root of relMSE, the mean of (I − R)² / (R² + 0.01) over
/// pixels and channels, R being what I converges to. `low` and `high` are bounds of the interval that holds the error
/// of this very image in 95 of 100 cases.
struct ErrorEstimate {
  double error = 0, low = 0, high = 0;
};

/// What is known of an image's error, as a whole and by blocks.
struct Convergence {
  ErrorEstimate estimate;
  std::vector<double> blocks;  ///< The mean of relMSE's terms over each block's pixels and channels.
};

/// From the two halves of every pixel's samples, which are independent of each other; `done` says how many there are.
/// Nothing where a pixel has less than two. All zero where the halves are equal everywhere: that isn't known to be
/// small then, but not known. Costs some hundred operations a pixel. Pure.
std::optional<Convergence> measure(const Sums& sums, const Pass& done);

/// How many samples each block's pixels ought to have, so that `budget` more of them, counted over all pixels, make the
/// error of the whole as small as they can: by the errors of `blocks` as `measure` gives them, of blocks that have had
/// the samples of `done`. No block is left far behind the others, whatever it shows: that nothing bright was seen in
/// few samples doesn't mean that nothing is there. At most `most` a pixel. The result is of the same length, and
/// nowhere less than there is. Pure, in a fixed order of operations.
std::vector<std::uint32_t> distribute(const std::vector<double>& blocks, const Pass& done, std::uint64_t budget,
                                      std::uint32_t most);

}  // namespace tessera
