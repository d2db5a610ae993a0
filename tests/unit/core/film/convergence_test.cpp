#include "core/film/convergence.h"

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/film/passes.h"
#include "tests/support/random.h"

namespace tessera {
namespace {

/// A number in [0, 1).
double uniform(Random& random) { return static_cast<double>(random.bits() >> 11) * 0x1p-53; }
double normal(Random& random) {
  return std::sqrt(-2 * std::log(1 - uniform(random))) * std::cos(2 * 3.14159265358979 * uniform(random));
}

/// Noise with mean 1: what a sample of a pixel is multiplied with.
struct Noise {
  const char* name;
  std::function<double(Random&)> draw;
};

const std::vector<Noise>& noises() {
  static const std::vector<Noise> all{
      {"normal", [](Random& r) { return 1 + 0.5 * normal(r); }},
      {"exponential", [](Random& r) { return -std::log(1 - uniform(r)); }},
      {"log-normal", [](Random& r) { return std::exp(1.2 * normal(r) - 0.72); }},
      {"rare and bright", [](Random& r) { return 0.7 + (uniform(r) < 0.003 ? 100.0 : 0.0); }},
      {"rarer and brighter", [](Random& r) { return 0.9 + 0.2 * normal(r) + (uniform(r) < 0.0005 ? 200.0 : 0.0); }},
  };
  return all;
}

/// What an image converges to: a smooth gradient, flat areas, fine stripes, and a dark corner.
Rgb truth_at(std::int32_t x, std::int32_t y, std::int32_t side) {
  const float u = static_cast<float>(x) / static_cast<float>(side),
              v = static_cast<float>(y) / static_cast<float>(side);
  if (u < 0.5F && v < 0.5F) return {0.1F + u, 0.3F, 0.2F + v};
  if (u < 0.5F) return x % 3 == 0 ? Rgb{0.8F, 0.8F, 0.8F} : Rgb{0.1F, 0.05F, 0.02F};
  if (v < 0.5F) return {0.01F, 0.02F, 0.005F};
  return {2.0F, 0.5F, 0.25F};
}

/// What samples come to, and how much of the noise they have.
struct Subject {
  std::function<Rgb(std::int32_t x, std::int32_t y, std::int32_t side)> truth = truth_at;
  std::function<double(std::int32_t x, std::int32_t y)> strength = [](auto, auto) { return 1.0; };
};

/// An image that samples come to, and what its error really is.
class Rendered {
 public:
  Rendered(const Settings& settings, const Noise& noise, std::uint64_t seed, Subject subject = {})
      : side_(static_cast<std::int32_t>(settings.width)),
        noise_(noise),
        subject_(std::move(subject)),
        random_(seed << 32),
        sums_({0, 0, side_, side_}, settings) {}

  void render(const Pass& pass) {
    for (std::int32_t y = 0; y < side_; ++y)
      for (std::int32_t x = 0; x < side_; ++x) {
        const SampleRange& range = pass.of(x, y);
        const Rgb truth = subject_.truth(x, y, side_);
        const double strength = subject_.strength(x, y);
        for (std::uint32_t i = range.first; i < range.end(); ++i)
          sums_.add(sums_.totals.index(x, y), i, truth * static_cast<float>(1 + strength * (noise_.draw(random_) - 1)));
      }
  }

  double true_error(const Pass& done) const {
    double sum = 0;
    for (std::int32_t y = 0; y < side_; ++y)
      for (std::int32_t x = 0; x < side_; ++x) {
        const std::size_t at = sums_.totals.index(x, y);
        const Rgb truth = subject_.truth(x, y, side_), total = sums_.totals.color[at] + sums_.second[at];
        const float n = static_cast<float>(done.of(x, y).end());
        for (const auto& [color, exact] :
             {std::pair{total.r / n, truth.r}, {total.g / n, truth.g}, {total.b / n, truth.b}}) {
          const double off = double{color} - exact;
          sum += off * off / (double{exact} * exact + 0.01);
        }
      }
    return std::sqrt(sum / (3.0 * side_ * side_));
  }
  const Sums& sums() const { return sums_; }

 private:
  std::int32_t side_;
  const Noise& noise_;
  Subject subject_;
  Random random_;
  Sums sums_;
};

constexpr std::int32_t kSide = 32;

Settings measured() {
  Settings settings;
  settings.width = settings.height = kSide;
  settings.samples = 1 << 20;
  settings.error = 1e-3F;
  return settings;
}

TEST(Convergence, IntervalsHoldTheTrueError) {
  for (const Noise& noise : noises())
    for (const std::uint32_t samples : {16U, 65U}) {
      constexpr int kImages = 40;
      int held = 0;
      for (std::uint64_t seed = 0; seed < kImages; ++seed) {
        Rendered image(measured(), noise, seed);
        const Pass pass(kSide, kSide, {0, samples});
        image.render(pass);
        const ErrorEstimate found = measure(image.sums(), pass)->estimate;
        const double error = image.true_error(pass);
        held += found.low <= error && error <= found.high;
        EXPECT_LT(found.low, found.error);
        EXPECT_LT(found.error, found.high);
      }
      EXPECT_GE(held, 0.93 * kImages) << noise.name << ", " << samples << " samples";
    }
}

/// A lamp whose upper edge covers a little of a row of pixels: a sample of those sees it, or the dark wall. Most of the
/// error is there, and neighbours up and down show something else altogether.
TEST(Convergence, IntervalsHoldTheTrueErrorAtTheEdgeOfALamp) {
  constexpr double kLamp = 18, kWall = 0.1, kCovered = 0.04, kEdge = kCovered * kLamp + (1 - kCovered) * kWall;
  const Noise noise{"edge", [](Random& r) { return (uniform(r) < kCovered ? kLamp : kWall) / kEdge; }};
  const auto is_beside = [](std::int32_t x, std::int32_t y) { return x < 4 || x >= 28 || y < 10 || y > 20; };
  const Subject lamp{
      .truth =
          [&](std::int32_t x, std::int32_t y, std::int32_t) {
            const auto v = static_cast<float>(is_beside(x, y) ? kWall : y == 10 ? kEdge : kLamp);
            return Rgb{v, 0.6F * v, 0.15F * v};
          },
      .strength = [&](std::int32_t x, std::int32_t y) { return !is_beside(x, y) && y == 10 ? 1.0 : 0.02; }};
  for (const std::uint32_t samples : {16U, 64U, 256U}) {
    constexpr int kImages = 60;
    int held = 0;
    for (std::uint64_t seed = 0; seed < kImages; ++seed) {
      Rendered image(measured(), noise, seed, lamp);
      const Pass pass(kSide, kSide, {0, samples});
      image.render(pass);
      const ErrorEstimate found = measure(image.sums(), pass)->estimate;
      const double error = image.true_error(pass);
      held += found.low <= error && error <= found.high;
    }
    EXPECT_GE(held, 0.93 * kImages) << samples << " samples";
  }
}

/// Where noise is plain, the interval is narrow and in its middle the truth.
TEST(Convergence, EstimatesAreAsGoodAsTheNoiseIsPlain) {
  const Pass pass(kSide, kSide, {0, 64});
  double ratio = 0;
  constexpr int kImages = 20;
  for (std::uint64_t seed = 0; seed < kImages; ++seed) {
    Rendered image(measured(), noises().front(), seed);
    image.render(pass);
    const ErrorEstimate found = measure(image.sums(), pass)->estimate;
    ratio += found.error / image.true_error(pass) / kImages;
    EXPECT_LT(found.high / found.low, 1.3);
  }
  EXPECT_NEAR(ratio, 1, 0.02);
}

TEST(Convergence, TransparentImagesAreMeasuredAsTheyLookOnWhite) {
  Settings transparent = measured();
  transparent.transparent = true;
  transparent.aovs.insert(Aov::alpha);
  const PixelRect image{0, 0, kSide, kSide}, top{0, 0, kSide, 8};
  Sums shadow(image, transparent), white(image, measured());
  const Pass pass(kSide, kSide, {0, 16});
  shadow.add_equal(top, {0, 16}, {}, 0);
  white.add_equal(top, {0, 16}, {1, 1, 1});
  Random random(7);
  for (std::int32_t y = top.y1; y < kSide; ++y)
    for (std::int32_t x = 0; x < kSide; ++x)
      for (std::uint32_t i = 0; i < 16; ++i) {
        const float covered = uniform(random) < 0.3 ? 1.0F : 0.0F;
        shadow.add(shadow.totals.index(x, y), i, {}, covered);
        white.add(white.totals.index(x, y), i, Rgb{1, 1, 1} * (1 - covered));
      }
  const auto of_shadow = measure(shadow, pass), on_white = measure(white, pass);
  ASSERT_TRUE(of_shadow && on_white);
  EXPECT_GT(of_shadow->estimate.error, 0.1);
  EXPECT_EQ(of_shadow->estimate.error, on_white->estimate.error);
  EXPECT_EQ(of_shadow->blocks, on_white->blocks);
}

TEST(Convergence, NothingIsKnownOfLessThanTwoSamples) {
  Settings settings = measured();
  const Sums sums({0, 0, kSide, kSide}, settings);
  Pass pass(kSide, kSide, {0, 2});
  EXPECT_EQ(measure(sums, pass)->estimate.high, 0) << "black, and no noise at all";
  pass.blocks.back().count = 1;
  EXPECT_FALSE(measure(sums, pass));
  settings.error.reset();
  EXPECT_FALSE(measure(Sums({0, 0, kSide, kSide}, settings), Pass(kSide, kSide, {0, 2}))) << "one replicate";
}

TEST(Convergence, SamplesGoWhereTheErrorIs) {
  const Pass done(64, 48, {0, 16});
  std::vector<double> blocks(12, 1e-4);
  blocks[5] = 1e-2;
  constexpr std::uint64_t kBudget = 64 * 48 * 16;
  const auto samples = distribute(blocks, done, kBudget, 1 << 20);
  ASSERT_EQ(samples.size(), blocks.size());
  std::uint64_t more = 0;
  for (std::size_t b = 0; b < samples.size(); ++b) {
    EXPECT_GE(samples[b], 16U);
    EXPECT_EQ(samples[b] % 2, 0U);
    EXPECT_LE(samples[b], samples[5]);
    more += 256U * (samples[b] - 16);
  }
  EXPECT_GT(samples[5], 64U);
  EXPECT_GT(samples[6], samples[11]) << "neighbours count as noisy as well";
  EXPECT_NEAR(static_cast<double>(more), kBudget, 0.1 * kBudget);
  // Half of them black: they aren't left behind for ever.
  for (std::size_t b = 0; b < 6; ++b) blocks[b] = 0;
  const auto far = distribute(blocks, done, 64 * 48 * 1000, 1 << 20);
  EXPECT_GE(far[0], 100U);
  for (const std::uint32_t n : distribute(blocks, done, 1 << 30, 99)) EXPECT_LE(n, 99U);
}

/// Renders until the passes end.
PassReport run(Passes& passes, Rendered& image) {
  do {
    image.render(passes.current());
    passes.store(image.sums());
  } while (passes.next(0));
  return passes.report();
}

TEST(Convergence, EndsWhenTheErrorIsWhatWasAskedFor) {
  // A quarter of the image is noisy.
  const auto strength = [](std::int32_t x, std::int32_t y) { return x < kSide / 2 && y < kSide / 2 ? 1.0 : 0.05; };
  Settings settings = measured();
  settings.error = 0.02F;
  int images = 0, held = 0, kept = 0;
  std::uint64_t adapted = 0, plain = 0;
  for (std::size_t noise = 0; noise < 3; ++noise)
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
      settings.adaptive = true;
      Rendered image(settings, noises()[noise], seed, {.strength = strength});
      Passes passes(settings);
      const PassReport report = run(passes, image);
      EXPECT_EQ(report.ended_by, EndedBy::error);
      EXPECT_EQ(report.low_total, report.samples);
      EXPECT_EQ(report.high_total, report.samples);
      const double error = image.true_error(passes.current());
      ++images;
      held += report.error->low <= error && error <= report.error->high;
      kept += error <= *settings.error;
      if (seed > 0) continue;
      adapted += report.samples;
      settings.adaptive = false;
      Rendered alike(settings, noises()[noise], seed, {.strength = strength});
      Passes even(settings);
      plain += run(even, alike).samples;
    }
  EXPECT_GE(held, 0.93 * images);
  EXPECT_GE(kept, 0.93 * images);
  EXPECT_LT(1.5 * static_cast<double>(adapted), static_cast<double>(plain));
}

}  // namespace
}  // namespace tessera
