#include "core/light/environment_table.h"

#include <array>
#include <cmath>
#include <memory>
#include <numeric>

#include "core/scene/studio.h"
#include "tests/support/scenes.h"
#include "tests/unit/core/light/light_checks.h"

namespace tessera::light_checks {
namespace {

EnvironmentMap black(std::uint32_t width, std::uint32_t height) {
  return {width, height, std::vector<Rgb>(std::size_t{width} * height)};
}

std::shared_ptr<const Scene> lit_by(EnvironmentMap map, std::array<float, 9> to_world = EnvironmentLight{}.to_world) {
  EnvironmentLight light;
  light.map = std::make_shared<const EnvironmentMap>(std::move(map));
  light.to_world = to_world;
  return SceneBuilder().light(light).build();
}

/// The mean of f over all directions, by a grid of equal areas.
template <typename F>
double over_all_directions(F f, int rows) {
  double sum = 0;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < 2 * rows; ++x) {
      const double cosine = 1 - (y + 0.5) * 2 / rows, sine = std::sqrt(1 - cosine * cosine);
      const double around = kPi * (x + 0.5) / rows;
      sum += f(*UnitVec3::normalize(Vec3d{sine * std::cos(around), cosine, sine * std::sin(around)}));
    }
  return sum / (2.0 * rows * rows);
}

/// One texel is 1; the corners of four cells of the grid between the texels' centres.
EnvironmentMap one_texel(std::uint32_t width, std::uint32_t height, std::uint32_t x, std::uint32_t y) {
  EnvironmentMap map = black(width, height);
  map.texels[y * width + x] = {1, 1, 1};
  return map;
}

/// Irradiance of one texel's light on a plane, in closed form but for the integral over the angle from +y: around the
/// axis the weights are a hat two texels wide, and the plane's normal is straight up.
double irradiance_of_texel(std::uint32_t width, std::uint32_t height, std::uint32_t y) {
  constexpr int kSteps = 200'000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double angle = kPi * (i + 0.5) / kSteps;
    if (std::cos(angle) <= 0) continue;
    double weight = 1 - std::abs(angle / kPi * height - (y + 0.5));
    const double row = angle / kPi * height;
    if (y == 0 && row < 0.5) weight = 1;
    if (y + 1 == height && row > height - 0.5) weight = 1;
    if (weight > 0) sum += weight * std::cos(angle) * std::sin(angle);
  }
  return sum * kPi / kSteps * 2 * kPi / width;
}

TEST(EnvironmentTable, DirectionsAreWhereThePictureSays) {
  // Four texels across, each two quarters: their centres lie at −135°, −45°, 45° and 135° from −z towards +x.
  EnvironmentMap map = black(4, 2);
  map.texels = {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {5, 0, 0}, {6, 0, 0}, {7, 0, 0}, {8, 0, 0}};
  const EnvironmentTable table(std::make_shared<const EnvironmentMap>(map));
  const float h = std::sqrt(0.5F), up = h;  // rows' centres are 45° up and down
  const auto at = [&](Vec3 way) { return table.look_up(*UnitVec3::normalize(way)).radiance.r; };
  EXPECT_NEAR(at({-h * h, up, h * h}), 1, 1e-5);
  EXPECT_NEAR(at({-h * h, up, -h * h}), 2, 1e-5);
  EXPECT_NEAR(at({h * h, up, -h * h}), 3, 1e-5);
  EXPECT_NEAR(at({h * h, up, h * h}), 4, 1e-5);
  EXPECT_NEAR(at({h * h, -up, -h * h}), 7, 1e-5);
  EXPECT_NEAR(at({0, up, -h}), 2.5, 1e-5) << "the middle of the picture";
  EXPECT_NEAR(at({0, up, h}), 2.5, 1e-5) << "the seam, between 4 and 1";
  EXPECT_NEAR(at({1, 0, 0}), (3 + 4 + 7 + 8) / 4.0, 1e-5);
}

TEST(EnvironmentTable, DensitiesAddUpToOneAndTheMeanIsRight) {
  for (int seed = 0; seed < 6; ++seed) {
    Random random(seed);
    const std::array<std::array<std::uint32_t, 2>, 6> sizes = {{{1, 1}, {1, 5}, {7, 1}, {16, 8}, {33, 21}, {64, 32}}};
    EnvironmentMap map = black(sizes[seed][0], sizes[seed][1]);
    for (Rgb& texel : map.texels)
      texel = random.bits() % 3 ? Rgb{} : Rgb{static_cast<float>(random.magnitude(-2, 2)), 0, 1};
    const EnvironmentTable table(std::make_shared<const EnvironmentMap>(map));
    if (table.mean_radiance() == 0) continue;
    EXPECT_NEAR(over_all_directions([&](Vec3 d) { return table.look_up(d).pdf; }, 500) * 4 * kPi, 1, 2e-3) << seed;
    const double mean = over_all_directions(
        [&](Vec3 d) {
          const Rgb c = table.look_up(d).radiance;
          return (c.r + c.g + c.b) / 3.0;
        },
        500);
    // Radiance is interpolated over angles, the mean over areas: the same but for the curvature of a texel.
    EXPECT_NEAR(table.mean_radiance() / mean, 1, 0.3) << seed;
  }
}

TEST(EnvironmentTable, MapsAreSampledAsClaimed) {
  Random random(4);
  EnvironmentMap map = black(24, 12);
  for (Rgb& texel : map.texels) {
    const auto value = static_cast<float>(random.magnitude(-1, 2));
    texel = {value, value, value};
  }
  map.texels[5 * 24 + 7] = {5000, 0, 0};
  const std::array<float, 9> turned{0.36F, 0.48F, -0.8F, -0.8F, 0.6F, 0, 0.48F, 0.64F, 0.6F};
  expect_sampled_as_claimed(lit_by(map), {0, 0, 0}, {}, DirectionCells({0, 1, 0}, 2));
  expect_sampled_as_claimed(lit_by(map, turned), {0, 0, 0}, {}, DirectionCells({0, 1, 0}, 2));
  expect_sampled_as_claimed(lit_by(one_texel(8, 4, 7, 0)), {0, 0, 0}, {}, DirectionCells({0, 1, 0}, 2));
}

TEST(EnvironmentTable, DensityIsZeroOnlyWhereRadianceIsAndTheirRatioHardlyVaries) {
  Random random(9);
  EnvironmentMap map = black(32, 16);
  for (Rgb& texel : map.texels) {
    const auto value = static_cast<float>(random.bits() % 3 == 0 ? random.magnitude(-3, 3) : 0);
    texel = {value, value, value};
  }
  const EnvironmentTable table(std::make_shared<const EnvironmentMap>(map));
  for (int i = 0; i < 200'000; ++i) {
    const auto [radiance, pdf] = table.look_up(to_float(random.direction()));
    EXPECT_EQ(radiance.is_black(), pdf == 0);
    if (pdf > 0) {
      const double ratio = radiance.g / pdf / (4 * kPi * table.mean_radiance());
      EXPECT_TRUE(ratio > 0.4 && ratio < 2.5) << ratio;
    }
  }
}

TEST(EnvironmentTable, Stress67_AConstantMapIsAConstant) {
  EnvironmentMap map = black(20, 10);
  for (Rgb& texel : map.texels) texel = {2, 2, 2};
  const auto scene = lit_by(map);
  for (const Vec3 normal : {Vec3{0, 1, 0}, Vec3{0, -1, 0}, Vec3{1, 0, 0}, Vec3{0.6F, 0, -0.8F}})
    expect_mean(irradiance(LightTable(scene), {0, 0, 0}, normal, 100'000), 2 * kPi);
  const LightTable table(scene);
  EXPECT_EQ(table.escaped(table.viewpoint({}, {}), {0, 0, 1}).radiance, (Rgb{2, 2, 2}));
  EXPECT_NEAR(table.escaped(table.viewpoint({}, {}), {0, 0, 1}).pdf, 1 / (4 * kPi), 1e-5);

  // Without a map every sample of a plane's light is worth the same.
  const auto plain = SceneBuilder().background({2, 2, 2}).build();
  const Moments found = irradiance(LightTable(plain), {0, 0, 0}, {0, 0, 1}, 1000);
  EXPECT_NEAR(found.mean(), 2 * kPi, 1e-5);
  EXPECT_NEAR(found.variance(), 0, 1e-8);
}

TEST(EnvironmentTable, Stress67_OneTexelAtThePoleTheSeamACorner) {
  for (const auto& [x, y] : {std::array{4U, 0U}, {15U, 3U}, {0U, 3U}, {0U, 0U}, {15U, 0U}, {7U, 2U}}) {
    SCOPED_TRACE(x * 100 + y);
    const auto scene = lit_by(one_texel(16, 8, x, y));
    expect_mean(irradiance(LightTable(scene), {0, 0, 0}, {0, 1, 0}, 200'000), irradiance_of_texel(16, 8, y));
  }
  const auto below = lit_by(one_texel(16, 8, 0, 7));
  EXPECT_EQ(irradiance(LightTable(below), {0, 0, 0}, {0, 1, 0}, 1000).mean(), 0);
  expect_mean(irradiance(LightTable(below), {0, 0, 0}, {0, -1, 0}, 200'000), irradiance_of_texel(16, 8, 0));
}

TEST(EnvironmentTable, Stress67_TurningMapAndNormalChangesNothing) {
  const std::array<float, 9> turned{0.36F, 0.48F, -0.8F, -0.8F, 0.6F, 0, 0.48F, 0.64F, 0.6F};
  const auto rotate = [&](Vec3 v) {
    return *UnitVec3::normalize(Vec3{dot(Vec3{turned[0], turned[1], turned[2]}, v),
                                     dot(Vec3{turned[3], turned[4], turned[5]}, v),
                                     dot(Vec3{turned[6], turned[7], turned[8]}, v)});
  };
  Random random(2);
  EnvironmentMap map = black(16, 8);
  for (Rgb& texel : map.texels) texel = {0, static_cast<float>(random.magnitude(-1, 1)), 0};
  const auto straight = lit_by(map), askew = lit_by(map, turned);
  const Vec3 normal{0.6F, 0.8F, 0};
  const Moments a = irradiance(LightTable(straight), {0, 0, 0}, normal, 50'000);
  const Moments b = irradiance(LightTable(askew), {0, 0, 0}, rotate(normal), 50'000);
  EXPECT_NEAR(a.mean() / b.mean(), 1, 1e-4);
  for (int i = 0; i < 100; ++i) {
    const Vec3 way = to_float(random.direction());
    EXPECT_NEAR(LightTable(straight).escaped(LightTable(straight).viewpoint({}, {}), way).radiance.g,
                LightTable(askew).escaped(LightTable(askew).viewpoint({}, {}), rotate(way)).radiance.g, 1e-3);
  }
}

TEST(EnvironmentTable, TheStudiosIsOneForAllScenes) {
  const auto studio = environment_table(studio_environment());
  EXPECT_EQ(studio, environment_table(studio_environment()));
  EXPECT_EQ(studio->bytes(), 0U);
  const auto map = std::make_shared<const EnvironmentMap>(black(8, 4));
  EXPECT_NE(environment_table(map), environment_table(map));
  EXPECT_GE(environment_table(map)->bytes(), 8 * 4 * sizeof(std::uint32_t));
  EnvironmentLight light;
  light.map = studio_environment();
  EXPECT_LT(memory_bytes(*SceneBuilder().light(light).build()), studio_environment()->texels.size());
}

TEST(EnvironmentTable, ABlackMapIsNoLight) {
  const auto scene = lit_by(black(8, 4));
  const LightTable table(scene);
  EXPECT_TRUE(table.empty());
  EXPECT_FALSE(table.sample(table.viewpoint({0, 0, 0}, {}), 0.5F, {0.5F, 0.5F}));
  EXPECT_TRUE(table.escaped(table.viewpoint({}, {}), {0, 1, 0}).radiance.is_black());
  EXPECT_EQ(table.escaped(table.viewpoint({}, {}), {0, 1, 0}).pdf, 0);
}

TEST(EnvironmentTable, EvenTheBrightestAndDarkestTexelsAreFinite) {
  EnvironmentMap map = black(8, 4);
  for (Rgb& texel : map.texels) texel = {1e-30F, 1e-30F, 1e-30F};
  map.texels[9] = {3e38F, 3e38F, 3e38F};
  const auto scene = lit_by(map);
  const LightTable table(scene);
  Random random(1);
  for (int i = 0; i < 10'000; ++i) {
    const auto sample = table.sample(table.viewpoint({0, 0, 0}, {}), random_pick(random), random_square(random));
    ASSERT_TRUE(sample);
    EXPECT_TRUE(std::isfinite(sample->pdf) && sample->pdf > 0 && is_finite(sample->radiance));
    EXPECT_TRUE(std::isfinite(table.escaped(table.viewpoint({}, {}), to_float(random.direction())).pdf));
  }
}

}  // namespace
}  // namespace tessera::light_checks
