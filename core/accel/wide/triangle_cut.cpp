#include "core/accel/wide/triangle_cut.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

/// In double a crossing is a + (b − a)·t: three differences, a quotient, a product and a sum, each off by 2^-53 of
/// itself at most, and none greater than 2·max(|a|, |b|). So less than this part of the greater of the two.
constexpr double kCrossingError = 0x1p-48;

/// Where an edge crosses a plane across `axis`: precondition, its ends lie strictly on different sides.
LanesBox crossing(Lanes a, Lanes b, int axis, float plane) {
  const double t = (double{plane} - a[axis]) / (double{b[axis]} - a[axis]);
  LanesBox point{min(a, b), max(a, b)};
  for (int other = 0; other < 3; ++other) {
    const double from = a[other], to = b[other];
    const double at = from + (to - from) * t, error = kCrossingError * std::max(std::abs(from), std::abs(to));
    point.lo[other] = std::max(point.lo[other], below(at - error));
    point.hi[other] = std::min(point.hi[other], above(at + error));
  }
  point.lo[axis] = point.hi[axis] = plane;
  return point;
}

}  // namespace

TriangleCut::TriangleCut(const Corners& corners, int axis, float plane) {
  for (std::size_t i = 0; i < 3; ++i) {
    const Lanes a = corners[i], b = corners[(i + 1) % 3];
    if (a[axis] <= plane) below.extend(a);
    if (a[axis] >= plane) above.extend(a);
    if ((a[axis] < plane && plane < b[axis]) || (b[axis] < plane && plane < a[axis])) {
      const LanesBox point = crossing(a, b, axis, plane);
      below.extend(point);
      above.extend(point);
    }
  }
}

}  // namespace tessera
