#include "core/film/sums.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

constexpr PixelRect kOne{0, 0, 1, 1};

Settings with(std::set<Aov> aovs, bool measured = false) {
  Settings settings;
  settings.width = settings.height = 1;
  settings.aovs = std::move(aovs);
  if (measured) settings.error = 0.1F;
  return settings;
}

Pixels resolved(const Sums& sums, const Settings& settings, std::uint32_t samples) {
  Pixels out(sums.rect(), settings.aovs);
  resolve(sums, Pass(settings.width, settings.height, {0, samples}), out);
  return out;
}

TEST(Sums, MeansAndVariances) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const Settings settings = with({Aov::variance, Aov::albedo, Aov::alpha, Aov::sample_count}, seed % 2 == 1);
    Random random(seed);
    Sums sums(kOne, settings);
    constexpr std::uint32_t kSamples = 101;
    double mean = 0;
    std::vector<double> values;
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      values.push_back(random.uniform(1000, 1001));
      mean += values.back() / kSamples;
      const auto v = static_cast<float>(values.back());
      sums.add(0, i, {v, 1, 0});
      sums.add(Aov::albedo, 0, Rgb{0.25F, i % 2 == 0 ? 1.0F : 0.0F, 0});
      if (i < 25) sums.add(Aov::alpha, 0, 1.0F);
      sums.add(Aov::cost_volumes, 0, 1.0F);  // isn't recorded
    }
    double variance = 0;
    for (const double v : values) variance += (v - mean) * (v - mean) / (kSamples - 1) / kSamples;
    const Pixels p = resolved(sums, settings, kSamples);
    EXPECT_NEAR(p.color[0].r, mean, 1e-3);
    EXPECT_EQ(p.color[0].g, 1);
    EXPECT_NEAR(p.plane<Rgb>(Aov::variance)[0].r, variance, 1e-3 * variance);
    EXPECT_EQ(p.plane<Rgb>(Aov::variance)[0].g, 0);
    EXPECT_FLOAT_EQ(p.plane<Rgb>(Aov::albedo)[0].g, 51.0F / 101);
    EXPECT_FLOAT_EQ(p.plane<float>(Aov::alpha)[0], 25.0F / 101);
    EXPECT_EQ(p.plane<std::uint32_t>(Aov::sample_count)[0], kSamples);
  }
}

TEST(Sums, ReplicatesAreKeptApart) {
  const Settings settings = with({}, true);
  Sums sums(kOne, settings);
  for (std::uint32_t i = 0; i < 7; ++i) sums.add(0, i, {static_cast<float>(i), 0, 0});
  EXPECT_EQ(sums.totals.color[0].r, 0 + 2 + 4 + 6);
  EXPECT_EQ(sums.second[0].r, 1 + 3 + 5);
  EXPECT_EQ(resolved(sums, settings, 7).color[0].r, 3);
}

/// Samples that are known to be alike give what they would have given one by one, in any passes.
TEST(Sums, EqualSamplesAreSummedAtOnce) {
  const Rgb color{0.1F, 3, 0};
  for (const bool measured : {false, true}) {
    const Settings settings = with({Aov::variance}, measured);
    Sums one_by_one(kOne, settings), at_once(kOne, settings);
    for (std::uint32_t i = 0; i < 99; ++i) one_by_one.add(0, i, color);
    for (const SampleRange& range : {SampleRange{0, 1}, {1, 4}, {5, 94}}) at_once.add_equal(kOne, range, color);
    EXPECT_EQ(at_once.totals.color, one_by_one.totals.color);
    EXPECT_EQ(at_once.second, one_by_one.second);
    EXPECT_EQ(at_once.mean, one_by_one.mean);
    EXPECT_EQ(at_once.squares, one_by_one.squares);
  }
}

}  // namespace
}  // namespace tessera
