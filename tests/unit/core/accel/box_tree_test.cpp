#include "core/accel/box_tree.h"

#include <set>

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

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

std::set<std::uint32_t> visited(const BoxTree& tree, const Ray& ray, float limit = kInfinity) {
  std::set<std::uint32_t> out;
  tree.visit(CullRay(ray, tree.root()), ray.t_min, limit, [&](std::uint32_t item, float keep) {
    EXPECT_TRUE(out.insert(item).second) << "visited twice: " << item;
    return keep;
  });
  return out;
}

TEST(BoxTree, VisitsEveryItemThatTheRayEnters) {
  const auto boxes = random_boxes(1, 2000);
  const BoxTree tree(boxes);
  const auto found = visited(tree, kAlongX);
  const CullRay exact(kAlongX, tree.root());
  int entered = 0;
  for (std::uint32_t i = 0; i < boxes.size(); ++i)
    if (!exact.misses(boxes[i], 0, kInfinity)) {
      ++entered;
      EXPECT_TRUE(found.contains(i)) << i;
    }
  EXPECT_GT(entered, 0);
  EXPECT_LT(found.size(), boxes.size() / 10) << "it culls";
}

TEST(BoxTree, LeavesOutWhatLiesBeyondTheLimit) {
  const BoxTree tree(random_boxes(1, 2000));
  EXPECT_LT(visited(tree, kAlongX, 4.2F).size(), visited(tree, kAlongX).size());
}

TEST(BoxTree, StopsWhenTold) {
  const BoxTree tree(random_boxes(1, 2000));
  int calls = 0;
  tree.visit(CullRay(kAlongX, tree.root()), 0, kInfinity, [&](std::uint32_t, float) { return ++calls, kStop; });
  EXPECT_EQ(calls, 1);
}

TEST(BoxTree, IsEmptyWithoutItemsAndLeavesOutEmptyBoxes) {
  EXPECT_TRUE(BoxTree({}).root().empty());
  EXPECT_TRUE(visited(BoxTree({}), kAlongX).empty());
  std::vector<Aabb> boxes = random_boxes(1, 1);
  boxes.insert(boxes.begin(), Aabb{});
  const BoxTree tree(boxes);
  EXPECT_EQ(tree.root(), boxes[1]);
  EXPECT_EQ(tree.stats().leaves, 1U);
}

TEST(BoxTree, StaysShallowWhenAllCentroidsAreEqual_Stress49) {
  const std::vector<Aabb> same(100'000, Aabb{{0, 0, 0}, {1, 1, 1}});
  const BoxTree tree(same);
  EXPECT_LE(tree.stats().depth, 20U);
  EXPECT_EQ(visited(tree, {{-1, 0.5F, 0.5F}, {1, 0, 0}}).size(), same.size());
}

TEST(BoxTree, StaysWithinItsStackForPowersOfTwo) {
  std::vector<Aabb> boxes;  // centroids 2^-k: each split takes one off
  for (int k = 0; k < 140; ++k) {
    const float x = std::ldexp(1.0F, -k);
    for (int twin = 0; twin < 20; ++twin) boxes.push_back({{x, 0, 0}, {x, 1, 1}});
  }
  const BoxTree tree(boxes);
  EXPECT_LE(tree.stats().depth, 96U);
  EXPECT_EQ(visited(tree, {{-1, 0.5F, 0.5F}, {1, 0, 0}}).size(), boxes.size());
}

TEST(BoxTree, TakesTheLargestCoordinates) {
  std::vector<Aabb> boxes;
  for (int i = 0; i < 100; ++i) {
    const float x = 1e16F * static_cast<float>(i);
    boxes.push_back({{x, -1e16F, -1e16F}, {x + 5e15F, 1e16F, 1e16F}});
  }
  EXPECT_EQ(visited(BoxTree(boxes), {{-1e17F, 0, 0}, {1, 0, 0}}).size(), boxes.size());
}

}  // namespace
}  // namespace tessera
