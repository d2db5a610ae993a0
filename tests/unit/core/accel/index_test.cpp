// What every index over items has in common, whatever it is made of.
#include <set>

#include <gtest/gtest.h>

#include "core/accel/bound_list.h"
#include "core/accel/bound_tree.h"
#include "core/accel/grid.h"
#include "core/accel/plane_tree.h"
#include "core/accel/tally.h"
#include "core/bounds/hull_bound.h"
#include "core/bounds/slab_bound.h"
#include "core/bounds/sphere_bound.h"
#include "tests/support/random.h"

namespace tessera {
namespace {

/// Items that are nothing but boxes.
class BoxItems : public Items {
 public:
  using Items::Items;
  bool are_primitives() const override { return true; }
  void outline(std::uint32_t item, Outline& out) const override {
    const Aabb& box = boxes()[item];
    for (int i = 0; i < 8; ++i)
      out.points.push_back({i & 1 ? box.hi.x : box.lo.x, i & 2 ? box.hi.y : box.lo.y, i & 4 ? box.hi.z : box.lo.z});
  }
  std::optional<std::array<Vec3, 3>> triangle(std::uint32_t) const override { return std::nullopt; }
};

template <typename B>
B bound() {
  if constexpr (std::same_as<B, SlabBound>)
    return SlabBound(slab_preset(7));
  else
    return B();
}

template <typename Index>
class IndexTest : public testing::Test {
 public:
  static Index make(std::vector<Aabb> boxes) {
    return Index(BoxItems(std::move(boxes)), bound<typename Index::BoundType>(), {});
  }
  /// Lists give what lies beyond a limit all the same, if its group begins before it.
  static std::set<std::uint32_t> visited(const Index& index, const Ray& ray, float limit = kInfinity) {
    std::set<std::uint32_t> out;
    index.visit(ray, {}, limit, NoTally(), [&](std::uint32_t item, float keep) {
      out.insert(item);
      return keep;
    });
    return out;
  }
};

using Indices =
    testing::Types<BoundTree<BoxBound>, BoundTree<SphereBound>, BoundTree<SlabBound>, BoundTree<HullBound>,
                   BoundList<BoxBound>, BoundList<SphereBound>, BoundList<SlabBound>, BoundList<HullBound>, Grid,
                   PlaneTree<AxisPlane, build_octree>, PlaneTree<AxisPlane, build_kd>, PlaneTree<FreePlane, build_bsp>>;
TYPED_TEST_SUITE(IndexTest, Indices);

std::vector<Aabb> random_boxes(std::uint64_t seed, int count) {
  Random random(seed);
  std::vector<Aabb> boxes;
  for (int i = 0; i < count; ++i) {
    const Vec3 p = to_float(random.in_cube());
    boxes.push_back({p, p + Vec3{0.1F, 0.1F, 0.1F}});
  }
  return boxes;
}

const Ray kAlongX{{-5, 0.01F, 0.02F}, {1, 0, 0}};

TYPED_TEST(IndexTest, VisitsEveryItemThatTheRayEnters) {
  const auto boxes = random_boxes(1, 2000);
  const auto index = TestFixture::make(boxes);
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const Ray ray{to_float(random.in_cube() * 3), to_float(random.direction())};
    const auto found = TestFixture::visited(index, ray);
    const CullRay exact(ray, index.root());
    for (std::uint32_t item = 0; item < boxes.size(); ++item) {
      if (!exact.misses(boxes[item], 0, kInfinity)) {
        ASSERT_TRUE(found.contains(item)) << "ray " << i;
      }
    }
    EXPECT_LT(found.size(), boxes.size() / 2) << "it culls";
  }
}

TYPED_TEST(IndexTest, LeavesOutWhatLiesBeyondTheLimit) {
  const auto index = TestFixture::make(random_boxes(1, 2000));
  EXPECT_LT(TestFixture::visited(index, kAlongX, 4.2F).size(), TestFixture::visited(index, kAlongX).size());
}

TYPED_TEST(IndexTest, StopsWhenTold) {
  const auto index = TestFixture::make(random_boxes(1, 2000));
  int calls = 0;
  index.visit(kAlongX, {}, kInfinity, NoTally(), [&](std::uint32_t, float) { return ++calls, kStop; });
  EXPECT_EQ(calls, 1);
}

TYPED_TEST(IndexTest, IsEmptyWithoutItemsAndLeavesOutEmptyBoxes) {
  EXPECT_TRUE(TestFixture::make({}).root().empty());
  EXPECT_TRUE(TestFixture::visited(TestFixture::make({}), kAlongX).empty());
  std::vector<Aabb> boxes = random_boxes(1, 1);
  boxes.insert(boxes.begin(), Aabb{});
  const auto index = TestFixture::make(boxes);
  EXPECT_EQ(index.root(), boxes[1]);
  const Vec3 middle = boxes[1].center();
  EXPECT_EQ(TestFixture::visited(index, {middle - Vec3{5, 0, 0}, {1, 0, 0}}), (std::set<std::uint32_t>{1}));
}

TYPED_TEST(IndexTest, StaysSmallAndShallowOverEqualItems_Stress47_Stress49) {
  const std::vector<Aabb> same(20'000, Aabb{{0, 0, 0}, {1, 1, 1}});
  const auto index = TestFixture::make(same);
  EXPECT_LE(index.stats().depth, 20U);
  EXPECT_LE(index.stats().bytes, same.size() * 200) << "what a node of the widest bound takes, and no entry twice";
  EXPECT_EQ(TestFixture::visited(index, {{-1, 0.5F, 0.5F}, {1, 0, 0}}).size(), same.size());
}

TYPED_TEST(IndexTest, CutsClustersAtPowersOfTwoWithoutEnd_Stress48) {
  std::vector<Aabb> boxes;
  for (int k = 0; k < 140; ++k) {
    const float x = std::ldexp(1.0F, -k);
    for (int twin = 0; twin < 20; ++twin) boxes.push_back({{x, 0, 0}, {x, 1, 1}});
  }
  const auto index = TestFixture::make(boxes);
  EXPECT_LE(index.stats().depth, 96U);
  EXPECT_EQ(TestFixture::visited(index, {{-1, 0.5F, 0.5F}, {1, 0, 0}}).size(), boxes.size());
  EXPECT_EQ(TestFixture::visited(index, {{1.5F, 0.5F, 0.5F}, {-1, 0, 0}}).size(), boxes.size());
}

TYPED_TEST(IndexTest, FindsFlatItemsOnCutsAndCellBorders_Stress48) {
  // An 8 × 8 × 8 lattice of flat squares, on every plane where a middle or a border of cells falls.
  std::vector<Aabb> boxes;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j)
        for (int k = 0; k < 8; ++k) {
          Aabb box;
          box.lo = {static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)};
          box.hi = box.lo + Vec3{1, 1, 1};
          box.hi[axis] = box.lo[axis];
          boxes.push_back(box);
        }
  const auto index = TestFixture::make(boxes);
  for (int x = 0; x <= 16; ++x)
    for (int y = 0; y <= 16; ++y) {
      // Down the cells' borders and edges, where both neighbours are touched.
      const Ray ray{{static_cast<float>(x) / 2, static_cast<float>(y) / 2, -3}, {0, 0, 1}};
      const auto found = TestFixture::visited(index, ray);
      const CullRay exact(ray, index.root());
      for (std::uint32_t item = 0; item < boxes.size(); ++item) {
        if (!exact.misses(boxes[item], 0, kInfinity)) {
          ASSERT_TRUE(found.contains(item)) << x << ' ' << y;
        }
      }
    }
}

TYPED_TEST(IndexTest, TakesTheLargestCoordinates) {
  std::vector<Aabb> boxes;
  for (int i = 0; i < 100; ++i) {
    const float x = 1e16F * static_cast<float>(i);
    boxes.push_back({{x, -1e16F, -1e16F}, {x + 5e15F, 1e16F, 1e16F}});
  }
  EXPECT_EQ(TestFixture::visited(TestFixture::make(boxes), {{-1e17F, 0, 0}, {1, 0, 0}}).size(), boxes.size());
  boxes.push_back({{-kInfinity, -1, -1}, {kInfinity, 1, 1}});
  EXPECT_EQ(TestFixture::visited(TestFixture::make(boxes), {{-1e17F, 0, 0}, {1, 0, 0}}).size(), boxes.size());
}

TYPED_TEST(IndexTest, CountsWhatItTests) {
  const auto index = TestFixture::make(random_boxes(1, 2000));
  TestCounts counts;
  std::uint64_t visits = 0;
  index.visit(kAlongX, {}, kInfinity, Tally(counts), [&](std::uint32_t, float keep) { return ++visits, keep; });
  EXPECT_GT(counts.volume_hits, 0U);
  EXPECT_GT(counts.volume_tests, counts.volume_hits);
  EXPECT_GT(counts.false_hits, 0U) << "nothing was ever reported as hit";
  EXPECT_LE(counts.false_hits, counts.volume_hits);
  EXPECT_EQ(counts.object_tests, 0U) << "items are for the leaf to count";
  TestCounts beside;
  index.visit({{-5, 100, 100}, {1, 0, 0}}, {}, kInfinity, Tally(beside), [&](std::uint32_t, float keep) {
    ADD_FAILURE() << "an item that the ray passes by";
    return keep;
  });
  EXPECT_GE(beside.volume_tests, 1U);
  EXPECT_EQ(beside.volume_hits + beside.false_hits, 0U);
}

}  // namespace
}  // namespace tessera
