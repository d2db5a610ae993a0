#include "core/accel/wide/binned_sah.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

std::vector<PrimitiveRef> boxes(std::uint64_t seed, std::uint32_t count) {
  Random random(seed);
  std::vector<PrimitiveRef> refs;
  for (std::uint32_t i = 0; i < count; ++i) {
    LanesBox box = LanesBox::empty();
    const Vec3d center = random.in_cube();
    for (int k = 0; k < 2; ++k) {
      const Vec3 p = to_float(center + random.in_cube() * 0.2);
      box.extend(Lanes{p.x, p.y, p.z, 0});
    }
    refs.push_back(PrimitiveRef::of(box, i));
  }
  return refs;
}

LanesBox middles(const std::vector<PrimitiveRef>& refs) {
  LanesBox box = LanesBox::empty();
  for (const PrimitiveRef& ref : refs) box.extend(ref.middle());
  return box;
}

/// Every plane between two bins, taken by itself. Eight references cost as much as one.
float cheapest(const std::vector<PrimitiveRef>& refs, const BinGrid& grid) {
  float best = kInfinity;
  for (int axis = 0; axis < 3; ++axis)
    for (int bin = 1; bin < grid.bins(); ++bin) {
      LanesBox side[2] = {LanesBox::empty(), LanesBox::empty()};
      float count[2] = {};
      for (const PrimitiveRef& ref : refs) {
        const bool right = grid.is_right_of(ref, axis, bin)[0];
        side[right].extend(ref.box());
        ++count[right];
      }
      if (count[0] > 0 && count[1] > 0)
        best = std::min(
            best, half_area(side[0], 1) * std::ceil(count[0] / 8) + half_area(side[1], 1) * std::ceil(count[1] / 8));
    }
  return best;
}

TEST(BinnedSah, FindsTheCheapestPlane) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const auto count = static_cast<std::uint32_t>(2 + seed);
    const std::vector<PrimitiveRef> refs = boxes(seed, count);
    const BinGrid grid(middles(refs), count);
    const Split split = bin_middles(refs, grid).best_split(count, 1);
    ASSERT_GE(split.axis, 0) << seed;
    EXPECT_NEAR(split.cost, cheapest(refs, grid), 1e-4F * split.cost) << seed;
    LanesBox left = LanesBox::empty(), right = LanesBox::empty();
    std::uint32_t lefts = 0;
    for (const PrimitiveRef& ref : refs) {
      const bool is_right = grid.is_right_of(ref, split.axis, split.bin)[0];
      (is_right ? right : left).extend(ref.box());
      lefts += !is_right;
    }
    EXPECT_EQ(split.left, lefts) << seed;
    EXPECT_EQ(split.left + split.right, count) << seed;
    EXPECT_EQ(split.left_box.aabb(), left.aabb()) << seed;
    EXPECT_EQ(split.right_box.aabb(), right.aabb()) << seed;
  }
}

TEST(BinnedSah, WhatHasOneMiddleIsNotParted) {
  std::vector<PrimitiveRef> refs = boxes(1, 1);
  refs.resize(50, refs[0]);
  EXPECT_EQ(bin_middles(refs, BinGrid(middles(refs), 50)).best_split(50, 1).axis, -1);
}

TEST(BinnedSah, AReferenceKnowsItsTriangle) {
  for (const std::uint32_t triangle : {0U, 1U, 0x7FFFFFU, 0x800000U, (1U << 30) - 1}) {
    const PrimitiveRef ref = PrimitiveRef::of({Lanes{1, 2, 3, 9}, Lanes{4, 5, 6, 9}}, triangle);
    EXPECT_EQ(ref.triangle(), triangle);
    EXPECT_EQ(ref.box().aabb(), (Aabb{{1, 2, 3}, {4, 5, 6}}));
  }
}

}  // namespace
}  // namespace tessera
