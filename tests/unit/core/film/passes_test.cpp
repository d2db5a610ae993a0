#include "core/film/passes.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

namespace tessera {
namespace {

Settings sized(std::uint32_t samples) {
  Settings settings;
  settings.width = 40;
  settings.height = 24;
  settings.samples = samples;
  return settings;
}

/// The counts of samples that pixels have after each pass, of an image without any noise.
std::vector<std::uint32_t> counts(const Settings& settings, double seconds_a_pass = 0) {
  Passes passes(settings);
  const Sums sums({0, 0, 40, 24}, settings);
  std::vector<std::uint32_t> out;
  double seconds = 0;
  do {
    std::uint32_t end = 0;
    for (const SampleRange& range : passes.current().blocks) {
      EXPECT_EQ(range.first, out.empty() ? 0 : out.back()) << "a pass begins where the one before has ended";
      EXPECT_GT(range.count, 0U);
      end = range.end();
    }
    out.push_back(end);
    passes.store(sums);
    seconds += seconds_a_pass;
    EXPECT_LT(out.size(), 1000U);
  } while (passes.next(seconds));
  EXPECT_EQ(passes.report().passes, out.size());
  EXPECT_EQ(passes.report().samples, std::uint64_t{out.back()} * 40 * 24);
  EXPECT_TRUE(passes.report().ended_by.has_value());
  return out;
}

TEST(Passes, BeginWithOneSampleAndEndWithAll) {
  using Counts = std::vector<std::uint32_t>;
  EXPECT_EQ(counts(sized(1)), Counts{1});
  EXPECT_EQ(counts(sized(2)), (Counts{1, 2}));
  EXPECT_EQ(counts(sized(100)), (Counts{1, 4, 16, 64, 96, 100}));
  for (const std::uint32_t most : {3U, 17U, 1000U, 4294967295U}) {
    const Counts all = counts(sized(most));
    EXPECT_EQ(all.back(), most);
    EXPECT_LT(all.size(), 70U) << "passes grow with the image";
  }
}

TEST(Passes, AreInPairsWhereTheErrorIsMeasured) {
  Settings settings = sized(1000);
  settings.seconds = 1e9;
  settings.adaptive = false;
  for (const std::uint32_t count : counts(settings, 1e-3)) EXPECT_TRUE(count == 1 || count % 2 == 0) << count;
}

/// What passes over an image come to whose halves differ by `noise` everywhere.
PassReport report_of(Settings settings, float noise, double seconds_a_pass = 0) {
  Passes passes(settings);
  double seconds = 0;
  do {
    Sums sums({0, 0, 40, 24}, settings);
    const auto n = static_cast<float>(passes.current().blocks.front().end());
    std::ranges::fill(sums.totals.color, Rgb{n, n, n});
    std::ranges::fill(sums.second, Rgb{n, n, n} * (1 + noise));
    passes.store(sums);
    seconds += seconds_a_pass;
  } while (passes.next(seconds));
  return passes.report();
}

TEST(Passes, ClaimNoErrorOfFewSamples) {
  for (const std::uint32_t samples : {2U, 16U, 272U}) {
    Settings settings = sized(samples);
    settings.error = 0.5F;
    const PassReport few = report_of(settings, 0.01F);
    EXPECT_EQ(few.ended_by, EndedBy::samples) << samples;
    EXPECT_FALSE(few.error) << samples;
  }
  Settings settings = sized(1000);
  settings.error = 0.5F;
  const PassReport enough = report_of(settings, 0.01F);
  EXPECT_EQ(enough.ended_by, EndedBy::error);
  EXPECT_GE(enough.least, 274U) << "a quarter of a million samples of 960 pixels";
  ASSERT_TRUE(enough.error);
  EXPECT_GT(enough.error->low, 0);
}

TEST(Passes, ClaimNoErrorWhereTimeIsOverEarly) {
  Settings settings = sized(1 << 20);
  settings.seconds = 1;
  const PassReport report = report_of(settings, 0.01F, 0.4);
  EXPECT_EQ(report.ended_by, EndedBy::seconds);
  EXPECT_EQ(report.least, 2U);
  EXPECT_FALSE(report.error);
}

/// Light that no sample has found yet looks like an image without noise.
TEST(Passes, ClaimNothingWhereNoSampleDiffers) {
  Settings settings = sized(1000);
  settings.error = 0.5F;
  const PassReport report = report_of(settings, 0);
  EXPECT_EQ(report.ended_by, EndedBy::samples);
  EXPECT_EQ(report.samples, 40U * 24 * 1000);
  EXPECT_FALSE(report.error);
}

/// Nor do more of them tell: who asks for an error alone isn't left waiting for the most that there may be.
TEST(Passes, EndWithoutAClaimWhereNoSampleEverDiffers) {
  Settings settings = sized(1U << 30);
  settings.error = 0.5F;
  const PassReport report = report_of(settings, 0);
  EXPECT_EQ(report.ended_by, EndedBy::samples);
  EXPECT_FALSE(report.error);
  EXPECT_GE(report.samples, 1U << 22);
  EXPECT_LE(report.samples, 1U << 23);
  EXPECT_EQ(report.high_total, report.samples);
  settings.error.reset();
  settings.seconds = 1;
  EXPECT_EQ(report_of(settings, 0, 0.04).ended_by, EndedBy::seconds) << "time is what was asked for";
}

TEST(Passes, ClaimNothingOfWhatIsClamped) {
  Settings settings = sized(1000);
  settings.error = 0.5F;
  settings.clamp = 10;
  EXPECT_EQ(report_of(settings, 0.01F).ended_by, EndedBy::samples);
  EXPECT_FALSE(report_of(settings, 0.01F).error);
}

TEST(Passes, OneIsEnoughWhereSamplesCannotDiffer) {
  Settings settings = sized(1000);
  settings.error = 0.01F;
  Passes passes(settings, true);
  passes.store(Sums({0, 0, 40, 24}, settings));
  EXPECT_FALSE(passes.next(0));
  EXPECT_EQ(passes.report().ended_by, EndedBy::error);
  EXPECT_EQ(passes.report().error->high, 0);
}

TEST(Passes, EndInTime) {
  Settings settings = sized(1 << 30);
  settings.seconds = 10;
  settings.adaptive = false;
  // A sample of all pixels takes a second, however many passes they come in.
  Passes passes(settings);
  const Sums sums({0, 0, 40, 24}, settings);
  double seconds = 0;
  do {
    seconds += passes.current().blocks.front().count;
    ASSERT_LE(seconds, 10);
  } while (passes.next(seconds));
  EXPECT_EQ(passes.report().ended_by, EndedBy::seconds);
  EXPECT_GE(seconds, 8) << "the last pass was made as long as there was time";
  EXPECT_EQ(passes.report().low_total, passes.report().samples);
}

TEST(Passes, TheFirstPassIsWholeHoweverLittleTimeThereIs) {
  Settings settings = sized(100);
  settings.seconds = 1e-9;
  EXPECT_EQ(counts(settings, 1), std::vector<std::uint32_t>{1});
}

TEST(Passes, TellWhatIsLeft) {
  Settings settings = sized(64);
  Passes plain(settings);
  EXPECT_EQ(plain.report().low_total, 40U * 24 * 64) << "known from the start";
  EXPECT_EQ(plain.report().high_total, 40U * 24 * 64);
  settings.error = 0.1F;
  Passes measured(settings);
  EXPECT_EQ(measured.report().low_total, 40U * 24);
  EXPECT_EQ(measured.report().high_total, 40U * 24 * 64);
}

TEST(Passes, TakeMemoryOnlyWhereThereIsMoreThanOne) {
  EXPECT_EQ(Passes::memory_bytes(sized(1)), 0U);
  EXPECT_EQ(Passes::memory_bytes(sized(2)), 40U * 24 * 12);
  Settings settings = sized(2);
  settings.error = 0.1F;
  settings.aovs = {Aov::variance, Aov::albedo, Aov::depth};
  EXPECT_EQ(Passes::memory_bytes(settings), 40U * 24 * (12 + 12 + 12 + 24));
}

}  // namespace
}  // namespace tessera
