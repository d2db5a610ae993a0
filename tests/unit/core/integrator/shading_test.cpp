#include "core/integrator/shading.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace tessera {
namespace {

/// A surface that faces up, whose interpolated normal makes `angle` with the way to a viewer at 80 degrees from it.
Shading seen_at(double angle) {
  const double viewer = 80 * 3.14159265358979 / 180, normal = viewer - angle;
  const SurfacePoint at{{}, {}, {0, 0, 1}, {std::sin(normal), 0, std::cos(normal)}};
  return {at, -to_float(Vec3d{std::sin(viewer), 0, std::cos(viewer)})};
}

TEST(Shading, NormalsThatFaceTheViewerStayAsTheyAre) {
  for (const double angle : {0.0, 0.5, 1.5}) {
    const Shading at = seen_at(angle);
    EXPECT_EQ(at.normal, to_float(at.surface.shading_normal));
  }
}

TEST(Shading, NormalsThatFaceAwayAreTurnedNoFurtherThanTheyMust) {
  const double right = 3.14159265358979 / 2;
  for (const double beyond : {1e-6, 0.01, 0.3}) {
    const Shading at = seen_at(right + beyond);
    EXPECT_GT(dot(at.normal, at.to_viewer), 0);
    EXPECT_NEAR(length(at.normal), 1, 1e-6);
    const double turned = std::acos(std::min(1.0, dot(to_double(at.normal), at.surface.shading_normal)));
    EXPECT_NEAR(turned, beyond, 2e-3) << "and not to the flat normal, 10 degrees from the edge of sight";
  }
}

TEST(Shading, OfAFlatSurfaceIsItsOwnNormalHoweverItIsSeen) {
  for (const float z : {1.0F, 1e-3F, 1e-20F, 0.0F}) {
    const Shading at({{}, {}, {0, 0, 1}, {0, 0, 1}}, {1, 0, -z});
    EXPECT_EQ(at.normal, at.flat_normal);
  }
}

}  // namespace
}  // namespace tessera
