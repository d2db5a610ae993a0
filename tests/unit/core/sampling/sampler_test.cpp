#include "core/sampling/sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/vec2.h"
#include "core/sampling/dimensions.h"
#include "core/sampling/pixel_samples.h"
#include "tests/support/recording_sampler.h"
#include "tests/support/statistics.h"

namespace tessera {
namespace {

constexpr std::array kKinds{SamplerKind::grid, SamplerKind::independent, SamplerKind::sobol};
constexpr std::array kDecisions{Decision::light_pick, Decision::light,    Decision::bsdf_lobe,
                                Decision::bsdf,       Decision::roulette, Decision::alpha};
constexpr bool is_pair(Decision d) { return d == Decision::light || d == Decision::bsdf; }

SampleId id_of(std::uint32_t pixel, std::uint32_t index) {
  return {static_cast<std::int32_t>(pixel % 256), static_cast<std::int32_t>(pixel / 256), index};
}

TEST(Dimensions, EachNumberHasOneMeaning) {
  std::set<std::uint32_t> seen{kFilmDimension.index, kFilmDimension.index + 1, kLensDimension.index,
                               kLensDimension.index + 1, kGridDimension.index};
  std::size_t count = 5;
  for (std::uint32_t vertex = 0; vertex < 200; ++vertex)
    for (const Decision d : kDecisions) {
      seen.insert(dimension(vertex, d).index);
      ++count;
      if (!is_pair(d)) continue;
      seen.insert(dimension(vertex, d).index + 1);
      ++count;
    }
  EXPECT_EQ(seen.size(), count);
}

/// `whitted`'s images depend on it: bytes, not only statistics.
TEST(Sampler, TheGridOnTheFilmIsPixelOffsets) {
  for (const std::uint64_t seed : {std::uint64_t{0}, std::uint64_t{7}, ~std::uint64_t{0}})
    for (const std::uint32_t samples : {1U, 4U, 6U, 7U, 64U})
      for (const bool jitter : {true, false}) {
        const PixelOffsets offsets(seed, samples, jitter);
        const Sampler sampler({.kind = SamplerKind::grid, .seed = seed, .samples = samples, .jitter = jitter});
        for (std::uint32_t pixel = 0; pixel < 500; ++pixel)
          for (std::uint32_t i = 0; i < samples; ++i) {
            const SampleId id = id_of(977 * pixel, i);
            const PixelOffset want = offsets.of(static_cast<std::uint32_t>(id.x), static_cast<std::uint32_t>(id.y), i);
            EXPECT_EQ(sampler.film(id).x, want.x);
            EXPECT_EQ(sampler.film(id).y, want.y);
          }
      }
}

TEST(Sampler, WithoutJitterTheFilmIsHitAtTheCentre) {
  for (const SamplerKind kind : kKinds) {
    const Sampler sampler({.kind = kind, .samples = 16, .jitter = false});
    EXPECT_EQ(sampler.film({3, 4, 5}).x, 0.5);
    EXPECT_EQ(sampler.film({3, 4, 5}).y, 0.5);
  }
}

TEST(Sampler, NumbersAreAPureFunctionOfSampleAndDimension) {
  for (const SamplerKind kind : kKinds) {
    const Sampler sampler({.kind = kind, .seed = 3, .samples = 16, .replicates = 2});
    std::vector<float> forward, backward;
    const auto numbers = [&](std::uint32_t n) {
      const PathSample sample = sampler.at(id_of(n / 64, n / 4 % 16));
      const Vec2 pair = sample.two(dimension(n % 4, Decision::bsdf));
      return std::array{sample.one(dimension(n % 4, Decision::roulette)), pair.x, pair.y};
    };
    for (std::uint32_t n = 0; n < 4096; ++n)
      for (const float v : numbers(n)) forward.push_back(v);
    for (std::uint32_t n = 4096; n-- > 0;) {
      const auto three = numbers(n);
      backward.insert(backward.end(), three.rbegin(), three.rend());
    }
    EXPECT_EQ(forward, std::vector<float>(backward.rbegin(), backward.rend()));
    // Kept with a path, or asked for anew.
    const SampleId id{-3, 1 << 30, 9};
    const PathSample kept = sampler.at(id);
    (void)kept.two(kLensDimension);
    EXPECT_EQ(kept.one(dimension(5, Decision::alpha)), sampler.one(id, dimension(5, Decision::alpha)));
    EXPECT_EQ(kept.two(kLensDimension).y, sampler.two(id, kLensDimension).y);
  }
}

TEST(Sampler, DifferInEveryArgument) {
  for (const SamplerKind kind : kKinds) {
    const auto one = [&](std::uint64_t seed, SampleId id, std::uint32_t vertex) {
      return Sampler({.kind = kind, .seed = seed}).one(id, dimension(vertex, Decision::bsdf_lobe));
    };
    const std::set<float> values{one(1, {2, 3, 4}, 5), one(2, {2, 3, 4}, 5), one(1, {3, 3, 4}, 5),
                                 one(1, {2, 4, 4}, 5), one(1, {2, 3, 5}, 5), one(1, {2, 3, 4}, 6)};
    EXPECT_EQ(values.size(), 6U);
  }
}

/// Whether n = 2^k points have one in each of the 2^k boxes of 2^-a × 2^-(k-a), for every a.
bool is_stratified(const std::vector<Vec2>& points, int k) {
  const std::size_t n = std::size_t{1} << k;
  for (int a = 0; a <= k; ++a) {
    std::vector<bool> taken(n);
    for (std::size_t i = 0; i < n; ++i) {
      const auto column = static_cast<std::size_t>(std::ldexp(points[i].x, a));
      const auto row = static_cast<std::size_t>(std::ldexp(points[i].y, k - a));
      const std::size_t box = column << (k - a) | row;
      if (taken[box]) return false;
      taken[box] = true;
    }
  }
  return true;
}

/// STRESS 65.
TEST(Sampler, SobolPairsAreStratifiedInAllElementaryIntervals_Stress65) {
  const int most = 12;
  for (const std::uint32_t replicates : {1U, 2U, 3U}) {
    const Sampler sampler({.kind = SamplerKind::sobol, .seed = 11, .replicates = replicates});
    for (std::uint32_t pixel = 0; pixel < 8; ++pixel)
      for (const Dimension d : {kFilmDimension, kLensDimension, dimension(0, Decision::light),
                                dimension(0, Decision::bsdf), dimension(31, Decision::bsdf)})
        for (std::uint32_t replicate = 0; replicate < replicates; ++replicate) {
          std::vector<Vec2> points;
          for (std::uint32_t i = 0; i < 1U << most; ++i)
            points.push_back(sampler.two(id_of(pixel, i * replicates + replicate), d));
          for (int k = 0; k <= most; ++k)
            EXPECT_TRUE(is_stratified(points, k)) << "pixel " << pixel << " dimension " << d.index << " 2^" << k;
        }
  }
  // Long sequences stay so.
  const Sampler sampler({.kind = SamplerKind::sobol});
  std::vector<Vec2> points;
  for (std::uint32_t i = 0; i < 1U << 17; ++i) points.push_back(sampler.two({1, 2, i}, kLensDimension));
  EXPECT_TRUE(is_stratified(points, 17));
}

TEST(Sampler, SobolSinglesAreStratified) {
  const Sampler sampler({.kind = SamplerKind::sobol, .seed = 12});
  for (const Decision d : {Decision::light_pick, Decision::bsdf_lobe, Decision::roulette, Decision::alpha})
    for (int k = 0; k <= 12; ++k) {
      std::vector<bool> taken(std::size_t{1} << k);
      for (std::uint32_t i = 0; i < 1U << k; ++i) {
        const auto box = static_cast<std::size_t>(std::ldexp(sampler.one({5, 6, i}, dimension(2, d)), k));
        EXPECT_FALSE(taken[box]) << k << ' ' << i;
        taken[box] = true;
      }
    }
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  Moments of_a, of_b;
  for (const double v : a) of_a.add(v);
  for (const double v : b) of_b.add(v);
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - of_a.mean()) * (b[i] - of_b.mean());
  return sum / static_cast<double>(a.size() - 1) / std::sqrt(of_a.variance() * of_b.variance());
}

/// What pixels are: a smooth slope, an edge, a small light.
constexpr int kIntegrands = 3;
double integrand(int which, Vec2 u) {
  if (which == 0) return std::exp(double{u.x}) * std::sin(3.0 * u.y + 0.5);
  if (which == 1) return std::hypot(u.x, u.y) < 0.8 ? 1 : 0;
  return u.x > 0.9 && u.y < 0.2 ? 1 : 0;
}
double integral(int which) {
  if (which == 0) return (std::numbers::e - 1) * (std::cos(0.5) - std::cos(3.5)) / 3;
  if (which == 1) return std::numbers::pi * 0.16;
  return 0.02;
}

/// A pixel's estimate from the samples first, first + step, …
double estimate(const Sampler& sampler, std::uint32_t pixel, std::uint32_t first, std::uint32_t step,
                std::uint32_t count, Dimension d, int which) {
  double sum = 0;
  for (std::uint32_t i = 0; i < count; ++i) sum += integrand(which, sampler.two(id_of(pixel, first + i * step), d));
  return sum / count;
}

/// STRESS 65: errors of two halves say what the error of their mean is only if they have nothing in common.
TEST(Sampler, ReplicatesAreUncorrelated_Stress65) {
  const std::uint32_t pixels = 4000;
  const Dimension d = dimension(0, Decision::light);
  for (const SamplerKind kind : kKinds)
    for (const std::uint32_t count : {1U, 3U, 16U})
      for (int which = 0; which < kIntegrands; ++which) {
        const Sampler sampler({.kind = kind, .seed = 21, .samples = 2 * count, .replicates = 2});
        std::vector<double> first, second, next;
        for (std::uint32_t pixel = 0; pixel < pixels; ++pixel) {
          first.push_back(estimate(sampler, pixel, 0, 2, count, d, which));
          second.push_back(estimate(sampler, pixel, 1, 2, count, d, which));
          next.push_back(estimate(sampler, pixel + 1, 0, 2, count, d, which));
        }
        const double limit = 3 / std::sqrt(pixels);
        EXPECT_LT(std::abs(correlation(first, second)), limit)
            << static_cast<int>(kind) << ' ' << count << ' ' << which;
        EXPECT_LT(std::abs(correlation(first, next)), limit) << static_cast<int>(kind) << ' ' << count << ' ' << which;
      }
}

TEST(Sampler, ReplicatesOnTheFilmAreUncorrelatedAndUnbiased) {
  const std::uint32_t pixels = 20'000;
  for (const SamplerKind kind : kKinds)
    for (const std::uint32_t samples : {2U, 3U, 10U, 16U}) {
      const Sampler sampler({.kind = kind, .seed = 22, .samples = samples, .replicates = 2});
      for (std::uint32_t i = 0; i + 1 < samples && i < 6; ++i) {
        std::vector<double> here, there;
        Moments x, x_squared, y;
        for (std::uint32_t pixel = 0; pixel < pixels; ++pixel) {
          const PixelOffset at = sampler.film(id_of(pixel, i));
          here.push_back(at.x);
          there.push_back(sampler.film(id_of(pixel, i + 1)).x);  // of the other replicate
          x.add(at.x);
          x_squared.add(at.x * at.x);
          y.add(at.y);
        }
        const double level = sidak(0.01, 3.0 * 18 * 3);
        EXPECT_LT(std::abs(correlation(here, there)), 3.5 / std::sqrt(pixels)) << static_cast<int>(kind) << ' ' << i;
        // Any number of samples, of whatever replicate, is spread over the whole pixel.
        EXPECT_GT(t_test(x, 0.5), level) << static_cast<int>(kind) << ' ' << samples << ' ' << i;
        EXPECT_GT(t_test(y, 0.5), level) << static_cast<int>(kind) << ' ' << samples << ' ' << i;
        EXPECT_GT(t_test(x_squared, 1.0 / 3), level) << static_cast<int>(kind) << ' ' << samples << ' ' << i;
      }
    }
}

TEST(Sampler, NumbersAreTheMiddlesOfIntervals) {
  for (const SamplerKind kind : kKinds) {
    const Sampler sampler({.kind = kind, .seed = 23, .samples = 16});
    float least = 1, most = 0;
    for (std::uint32_t pixel = 0; pixel < 65'536; ++pixel)
      for (std::uint32_t i = 0; i < 16; ++i) {
        const Vec2 pair = sampler.two(id_of(pixel, i), kLensDimension);
        for (const float v : {sampler.one(id_of(pixel, i), dimension(0, Decision::alpha)), pair.x, pair.y}) {
          const float place = v * 0x1p23F;
          ASSERT_EQ(place - std::floor(place), 0.5F) << v;
          least = std::min(least, v);
          most = std::max(most, v);
        }
      }
    EXPECT_TRUE(least > 0 && least < 1e-5F) << least;
    EXPECT_TRUE(most < 1 && most > 1 - 1e-5F) << most;
  }
}

/// χ² of the cells of `per_axis` × `per_axis` that points fall into.
template <class Point>
double uniformity(std::size_t count, std::size_t per_axis, Point point) {
  std::vector<double> observed(per_axis * per_axis);
  const auto cells = static_cast<float>(per_axis);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec2 u = point(static_cast<std::uint32_t>(i));
    ++observed[static_cast<std::size_t>(u.x * cells) * per_axis + static_cast<std::size_t>(u.y * cells)];
  }
  const double expected = static_cast<double>(count) / static_cast<double>(observed.size());
  return chi_square_test(observed, std::vector<double>(observed.size(), expected)).p;
}

TEST(Sampler, NumbersAreUniformAndIndependentBetweenPixelsSamplesAndDimensions) {
  const std::size_t count = 200'000, cells = 24;  // not a power of two
  const Dimension pair = dimension(1, Decision::bsdf), single = dimension(1, Decision::roulette);
  const double level = sidak(0.01, 2.0 * 6);
  for (const SamplerKind kind : {SamplerKind::independent, SamplerKind::sobol}) {
    const Sampler s({.kind = kind, .seed = 31});
    const auto same = [&](Dimension a, Dimension b, std::uint32_t right, std::uint32_t later) {
      return uniformity(count, cells, [&](std::uint32_t i) {
        return Vec2{s.two(id_of(i, 5), a).x, s.two(id_of(i + right, 5 + later), b).x};
      });
    };
    EXPECT_GT(uniformity(count, cells, [&](std::uint32_t i) { return s.two(id_of(i, 5), pair); }), level);
    EXPECT_GT(same(pair, {pair.index + 16}, 0, 0), level);  // the next vertex
    EXPECT_GT(same(pair, {pair.index - 4}, 0, 0), level);   // another decision
    EXPECT_GT(same(pair, pair, 1, 0), level);               // the pixel on the right
    EXPECT_GT(same(pair, pair, 256, 0), level);             // the pixel below
    EXPECT_GT(uniformity(count, cells,
                         [&](std::uint32_t i) {
                           return Vec2{s.one(id_of(i, 5), single), s.two(id_of(i, 5), pair).y};
                         }),
              level);
  }
}

/// Padding: two dimensions of one pixel's samples, each well spread, together have to be as if they were independent.
TEST(Sampler, PaddedDimensionsOfAPixelAreIndependent) {
  const std::uint32_t samples = 64, pixels = 3000, cells = 8;
  const Sampler s({.kind = SamplerKind::sobol, .seed = 32});
  const auto expect_independent = [&](auto first, auto second) {
    EXPECT_GT(uniformity(samples * pixels, cells,
                         [&](std::uint32_t i) {
                           const PathSample sample = s.at(id_of(i / samples, i % samples));
                           return Vec2{first(sample), second(sample)};
                         }),
              sidak(0.01, 4));
    // Of each two neighbours (samples 2j and 2j + 1) one is in each half, in both dimensions; whether it is the same
    // one is a fair coin. So the number of samples in a quarter is binomial over half the samples.
    Moments squares;
    for (std::uint32_t pixel = 0; pixel < pixels; ++pixel) {
      double both = 0;
      for (std::uint32_t i = 0; i < samples; ++i) {
        const PathSample sample = s.at(id_of(pixel, i));
        both += first(sample) < 0.5F && second(sample) < 0.5F ? 1 : 0;
      }
      squares.add((both - samples / 4.0) * (both - samples / 4.0));
    }
    EXPECT_GT(t_test(squares, samples / 8.0), sidak(0.01, 4));
  };
  const auto x = [](std::uint32_t vertex, Decision d) {
    return [=](const PathSample& sample) { return sample.two(dimension(vertex, d)).x; };
  };
  const auto one = [](Decision d) { return [=](const PathSample& sample) { return sample.one(dimension(0, d)); }; };
  expect_independent(x(0, Decision::light), x(0, Decision::bsdf));
  expect_independent(x(0, Decision::bsdf), x(1, Decision::bsdf));
  expect_independent(one(Decision::light_pick), x(0, Decision::light));
  expect_independent(one(Decision::light_pick), one(Decision::bsdf_lobe));
}

TEST(Sampler, EstimatesHaveNoBiasAtAnyCount) {
  const Dimension d = dimension(0, Decision::light);
  for (const SamplerKind kind : {SamplerKind::independent, SamplerKind::sobol})
    for (const std::uint32_t count : {1U, 2U, 3U, 7U, 8U, 21U, 64U})
      for (int which = 0; which < kIntegrands; ++which) {
        const Sampler sampler({.kind = kind, .seed = 41});
        Moments means;
        for (std::uint32_t pixel = 0; pixel < 4000; ++pixel) means.add(estimate(sampler, pixel, 0, 1, count, d, which));
        EXPECT_GT(t_test(means, integral(which)), sidak(0.01, 2 * 7 * 3)) << count << ' ' << which;
      }
}

/// STRESS 59, for the sampler alone: the slope of log RMSE over log samples.
TEST(Sampler, ErrorsFallAsFastAsTheyShould) {
  const auto rmse = [&](SamplerKind kind, std::uint32_t count, int which) {
    const Sampler sampler({.kind = kind, .seed = 42});
    double sum = 0;
    const std::uint32_t pixels = 1000;
    for (std::uint32_t pixel = 0; pixel < pixels; ++pixel) {
      const double e = estimate(sampler, pixel, 0, 1, count, kLensDimension, which) - integral(which);
      sum += e * e;
    }
    return std::sqrt(sum / pixels);
  };
  const auto slope = [&](SamplerKind kind, int which) {
    return std::log2(rmse(kind, 1024, which) / rmse(kind, 4, which)) / 8;
  };
  for (int which = 0; which < kIntegrands; ++which) {
    EXPECT_NEAR(slope(SamplerKind::independent, which), -0.5, 0.05) << which;
  }
  EXPECT_LT(slope(SamplerKind::sobol, 0), -1.3);  // smooth: N^(-3/2) (Owen 1997)
  EXPECT_LT(slope(SamplerKind::sobol, 1), -0.7);  // with an edge in two dimensions: N^(-3/4)
  EXPECT_LT(slope(SamplerKind::sobol, 2), -0.6);
  // Half the time for an error, at 64 samples.
  for (int which = 0; which < kIntegrands; ++which)
    EXPECT_LT(std::numbers::sqrt2 * rmse(SamplerKind::sobol, 64, which), rmse(SamplerKind::independent, 64, which))
        << which;
}

TEST(RecordingSampler, GivesTheSameNumbersAndFindsWhatIsDrawnTwice) {
  const Sampler plain({.kind = SamplerKind::sobol, .seed = 51});
  const RecordingSampler recording(plain);
  const SampleId id{1, 2, 3};
  EXPECT_EQ(recording.film(id).x, plain.film(id).x);
  EXPECT_EQ(recording.two(id, dimension(0, Decision::bsdf)).y, plain.two(id, dimension(0, Decision::bsdf)).y);
  EXPECT_EQ(recording.at(id).one(dimension(0, Decision::alpha)), plain.one(id, dimension(0, Decision::alpha)));
  EXPECT_EQ(recording.draws_of(kFilmDimension), 1U);
  EXPECT_EQ(recording.draws_of(kLensDimension), 0U);
  EXPECT_TRUE(recording.repeats().empty());
  (void)recording.one({1, 2, 4}, dimension(0, Decision::alpha));  // another sample's
  EXPECT_TRUE(recording.repeats().empty());
  (void)recording.one(id, {dimension(0, Decision::bsdf).index + 1});  // the pair's second
  ASSERT_EQ(recording.repeats().size(), 1U);
  EXPECT_EQ(recording.repeats()[0], "sample 3 of pixel (1, 2) draws dimension 23 2 times");
}

}  // namespace
}  // namespace tessera
