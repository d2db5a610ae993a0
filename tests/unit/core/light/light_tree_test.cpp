#include "core/light/light_tree.h"

#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/unit_vec3.h"
#include "tests/support/random.h"
#include "tests/support/statistics.h"

namespace tessera {
namespace {

LightBounds point_light(Vec3 at, double intensity) { return {.box = {at, at}, .intensity = intensity}; }

/// Points, flat lights of any size that face any way or both, and spots.
std::vector<LightBounds> mixed_lights(Random& random, int count, double least_power, double most_power) {
  std::vector<LightBounds> lights;
  for (int i = 0; i < count; ++i) {
    const Vec3 at = to_float(random.in_cube() * 10);
    LightBounds light = point_light(at, random.magnitude(least_power, most_power));
    const int kind = static_cast<int>(random.bits() % 4);
    if (kind > 0) {
      light.axis = to_float(random.direction());
      light.cos_spread = 1;
    }
    if (kind == 2) light.box.extend(at + to_float(random.in_cube() * random.magnitude(-3, 0.5)));
    if (kind == 3) light.cos_reach = static_cast<float>(random.uniform(0, 1));
    light.both_sides = kind == 2 && random.bits() % 2;
    lights.push_back(light);
  }
  return lights;
}

double sum_of_probabilities(const LightTree& tree, std::size_t lights, Vec3d point, Vec3 normal) {
  double sum = 0;
  for (std::uint32_t i = 0; i < lights; ++i) sum += tree.probability(i, point, normal);
  return sum;
}

TEST(LightTree, ProbabilitiesAddUpAndAreThoseOfPicking) {
  for (int seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const int count = 1 + static_cast<int>(random.bits() % 60);
    const auto lights = mixed_lights(random, count, -2, 2);
    const LightTree tree(lights);
    EXPECT_EQ(tree.size(), lights.size());
    const Vec3d point = random.in_cube() * 12;
    const Vec3 normal = seed % 2 ? to_float(random.direction()) : Vec3{};
    EXPECT_NEAR(sum_of_probabilities(tree, lights.size(), point, normal), 1, 1e-9);

    std::vector<double> picked(lights.size()), expected(lights.size());
    constexpr int kPicks = 20'000;
    for (int i = 0; i < kPicks; ++i) {
      const auto found = tree.pick(point, normal, random.uniform(0, 1));
      ++picked[found.light];
      ASSERT_EQ(found.probability, tree.probability(found.light, point, normal));
    }
    for (std::uint32_t i = 0; i < lights.size(); ++i) expected[i] = kPicks * tree.probability(i, point, normal);
    EXPECT_GT(chi_square_test(picked, expected).p, 1e-4);
  }
}

TEST(LightTree, NoLightIsLeftOutThatMaySendAnything) {
  // What is reached counts, down to grazing angles: points are put into the planes of lights, and beside them.
  int reached = 0;
  for (int seed = 0; seed < 300; ++seed) {
    Random random(seed);
    const auto lights = mixed_lights(random, 30, -10, 10);
    const LightTree tree(lights);
    for (int i = 0; i < 40; ++i) {
      const LightBounds& near = lights[random.bits() % lights.size()];
      Vec3d point = to_double(near.box.hi) + random.in_cube() * random.magnitude(-6, 1);
      if (i % 2) {
        const Vec3d axis = to_double(near.axis);
        point = point - axis * (dot(axis, point - to_double(near.box.lo)) - random.magnitude(-7, -1));
      }
      const Vec3 normal = i % 3 ? to_float(random.direction()) : Vec3{};
      for (std::uint32_t l = 0; l < lights.size(); ++l) {
        const LightBounds& light = lights[l];
        // A place in its box sends light along the axis of the light and around it.
        Vec3d at;
        for (int k = 0; k < 3; ++k) at[k] = random.uniform(light.box.lo[k], light.box.hi[k]);
        const Vec3d way = point - at;
        const double cosine = dot(way / length(way), to_double(light.axis));
        const bool is_sent = light.cos_spread < 0 || cosine > light.cos_reach || (light.both_sides && cosine < 0);
        const bool is_lit = normal == Vec3{} || dot(way, to_double(normal)) < 0;
        if (!is_sent || !is_lit) continue;
        ++reached;
        EXPECT_GT(tree.probability(l, point, normal), 0) << seed << " " << l;
        EXPECT_GT(tree.irradiance(point, normal), 0) << seed << " " << l;
      }
    }
  }
  EXPECT_GT(reached, 50'000);
}

TEST(LightTree, IrradianceIsAboutTheSum) {
  const Vec3d point{1, 2, 3};
  std::vector<LightBounds> lights;
  EXPECT_FALSE(LightTree(lights).size() > 0);
  double sum = 0, facing = 0;
  for (const double side : {-1.0, 1.0}) {
    lights.push_back(point_light({1, static_cast<float>(2 + side), 7}, 34));
    sum += 34 / 17.0 * 4 / std::sqrt(17.0);
    facing += 34 / 17.0;
    const LightTree tree(lights);
    EXPECT_NEAR(tree.irradiance(point, {0, 0, 1}), sum, 1e-6 * sum);
    EXPECT_NEAR(tree.irradiance(point, {}), facing, 1e-6 * facing);
    EXPECT_EQ(tree.irradiance(point, {0, 0, -1}), 0);
  }
}

TEST(LightTree, OneLightNeedsNoHierarchyAndNoneIsPickedWithoutIntensity) {
  const std::vector<LightBounds> lights = {point_light({0, 0, 0}, 0), point_light({1, 0, 0}, 2),
                                           point_light({2, 0, 0}, 0)};
  const LightTree tree(lights);
  EXPECT_EQ(tree.size(), 1U);
  const auto picked = tree.pick({0, 0, 0}, {}, 0.7);
  EXPECT_EQ(picked.light, 1U);
  EXPECT_EQ(picked.probability, 1);
  EXPECT_EQ(tree.probability(0, {0, 0, 0}, {}), 0);
  EXPECT_EQ(tree.probability(1, {0, 0, 0}, {}), 1);
  EXPECT_EQ(LightTree({}).size(), 0U);
}

TEST(LightTree, LightsInOnePlaceAreToldApart) {
  for (const int count : {2, 3, 100, 5000}) {
    std::vector<LightBounds> lights(static_cast<std::size_t>(count), point_light({1, 2, 3}, 1));
    const LightTree tree(lights);
    EXPECT_NEAR(sum_of_probabilities(tree, lights.size(), {0, 0, 0}, {}), 1, 1e-9);
    EXPECT_NEAR(sum_of_probabilities(tree, lights.size(), {1, 2, 3}, {}), 1, 1e-9) << "where they are";
    for (std::uint32_t i = 0; i < lights.size(); ++i)
      EXPECT_LT(std::abs(tree.probability(i, {0, 0, 0}, {}) * count - 1), 1.01) << i;
  }
}

TEST(LightTree, WaysStayShortHoweverLightsLie) {
  // Each twice as far off as the one before: the heuristic would cut them off one by one.
  std::vector<LightBounds> lights;
  for (int i = -60; i < 60; ++i)
    for (int k = 0; k < 20; ++k) {
      const auto x = static_cast<float>(std::ldexp(1.0 + k / 64.0, i));
      lights.push_back(point_light({x, 0, 0}, std::ldexp(1.0, 2 * i)));
    }
  const LightTree tree(lights);
  for (const double x : {0.0, 1.0, 1e9}) EXPECT_NEAR(sum_of_probabilities(tree, lights.size(), {x, 1, 0}, {}), 1, 1e-9);
}

TEST(LightTree, ScenesOfAnySizeAreAlike) {
  Random random(5);
  const auto lights = mixed_lights(random, 200, -1, 1);
  const LightTree tree(lights);
  for (const float scale : {1e-15F, 1e15F}) {
    auto scaled = lights;
    for (LightBounds& light : scaled) light.box = {light.box.lo * scale, light.box.hi * scale};
    const LightTree other(scaled);
    for (int i = 0; i < 20; ++i) {
      const Vec3d point = random.in_cube() * 10;
      for (std::uint32_t l = 0; l < lights.size(); ++l)
        EXPECT_NEAR(other.probability(l, point * scale, {}), tree.probability(l, point, {}), 0.02) << l;
    }
  }
}

TEST(LightTree, ErrorsAreAThirdOfThoseOfPickingEvenly) {
  // A ceiling of equal lights, and one far off that is worth as much as those right above.
  std::vector<LightBounds> lights;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      lights.push_back(point_light({static_cast<float>(x), static_cast<float>(y), 5}, 1));
      lights.back().axis = {0, 0, -1};
      lights.back().cos_spread = 1;
    }
  lights.push_back(point_light({32, 32, 500}, 1e5));
  const LightTree tree(lights);
  Random random(3);
  for (int i = 0; i < 10; ++i) {
    const Vec3d point{random.uniform(0, 64), random.uniform(0, 64), random.uniform(0, 4)};
    double sum = 0, squares = 0, squares_by_tree = 0;
    for (std::uint32_t l = 0; l < lights.size(); ++l) {
      const Vec3d way = to_double(lights[l].box.lo) - point;
      const double square = dot(way, way), worth = lights[l].intensity * way.z * way.z / (square * square);
      sum += worth;
      squares += worth * worth * static_cast<double>(lights.size());
      squares_by_tree += worth * worth / tree.probability(l, point, {0, 0, 1});
    }
    EXPECT_LT(std::sqrt(squares_by_tree - sum * sum), std::sqrt(squares - sum * sum) / 3);
  }
}

/// Each light's worth at the point is known, so the estimate's mean is too.
TEST(LightTree, Stress75_AMillionLightsOfAllPowers) {
  Random random(75);
  constexpr int kLights = 1'000'000;
  std::vector<LightBounds> lights = mixed_lights(random, kLights, -15, 15);
  lights.back().intensity = 0;
  const LightTree tree(lights);
  EXPECT_EQ(tree.size(), lights.size() - 1);
  const Vec3d point{1, 2, 3};
  EXPECT_NEAR(sum_of_probabilities(tree, lights.size(), point, {}), 1, 1e-6);

  const auto worth = [&](std::uint32_t i) {
    const Vec3d way = to_double(lights[i].box.hi) - point;
    const double square = dot(way, way);
    const double cosine = -dot(way, to_double(lights[i].axis)) / std::sqrt(square);
    const double sent = lights[i].cos_spread < 0 ? 1 : lights[i].both_sides ? std::abs(cosine) : cosine;
    return sent > lights[i].cos_reach ? lights[i].intensity * sent / square : 0;
  };
  double right = 0;
  for (std::uint32_t i = 0; i < lights.size(); ++i) right += worth(i);
  Moments found;
  for (int i = 0; i < 100'000; ++i) {
    const auto [light, probability, rest] = tree.pick(point, {}, random.uniform(0, 1));
    ASSERT_TRUE(probability > 0 && std::isfinite(probability));
    found.add(worth(light) / probability);
  }
  EXPECT_GT(t_test(found, right), 1e-3) << found.mean() << " instead of " << right;
}

}  // namespace
}  // namespace tessera
