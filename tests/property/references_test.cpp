// Ignis' scenes beside Mitsuba's references of 4096 samples: means, and a test of every pixel.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "proto/parse.h"
#include "tests/support/effort.h"
#include "tests/support/files_beside.h"
#include "tests/support/float_image.h"
#include "tests/support/image.h"
#include "tests/support/reference_scenes.h"
#include "tests/support/shared_data.h"

namespace tessera {
namespace {

constexpr double kReferenceSamples = 4096;
constexpr int kRenders = 32;

/// What independent renders say of each pixel's channel: the mean of all, and the variance of one sample.
class Estimates {
 public:
  explicit Estimates(std::size_t count) : sums_(count), squares_(count) {}

  void add(const std::vector<Rgb>& pixels, int samples) {
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      const double value = channels(pixels[i / 3])[i % 3];
      sums_[i] += value;
      squares_[i] += value * value;
    }
    ++renders_;
    samples_ = samples;
  }

  double mean(std::size_t i) const { return sums_[i] / renders_; }
  double variance_of_mean(std::size_t i) const {
    return std::max(0.0, squares_[i] / renders_ - mean(i) * mean(i)) / (renders_ - 1);
  }
  double variance_of_sample(std::size_t i) const { return variance_of_mean(i) * renders_ * samples_; }

 private:
  std::vector<double> sums_, squares_;
  int renders_ = 0, samples_ = 0;
};

Estimates estimate(const std::shared_ptr<const Scene>& scene, std::uint32_t max_depth, std::uint32_t side,
                   std::uint32_t samples) {
  Settings settings;
  settings.width = settings.height = side;
  settings.samples = samples;
  settings.max_depth = max_depth;
  settings.integrator = IntegratorKind::path;
  settings.sampler = SamplerKind::independent;
  settings.adaptive = false;
  Estimates estimates(3 * std::size_t{side} * side);
  for (int i = 0; i < kRenders; ++i) {
    settings.seed = static_cast<std::uint64_t>(i);
    estimates.add(render_image(scene, *scene->camera, settings, 2).pixels.color, static_cast<int>(samples));
  }
  return estimates;
}

/// Mitsuba carried light by wavelengths: even a pixel that sees a constant sky of 1, as all do in the upper eighth of
/// plane-d1, differs from it. The variance there, by channel.
std::array<double, 3> wavelength_noise(const FloatImage& plane) {
  const std::size_t count = plane.pixels.size() / 8;
  std::array<double, 3> variance{};
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      variance[c] += std::pow(channels(plane.pixels[i])[c] - 1, 2) / static_cast<double>(count);
  return variance;
}

/// Beyond so many standard deviations, on either side, a normal variable has this probability.
double deviations_of(double probability) {
  double lo = 0, hi = 40;
  while (hi - lo > 1e-9) {
    const double middle = (lo + hi) / 2;
    (std::erfc(middle / std::sqrt(2)) > probability ? lo : hi) = middle;
  }
  return lo;
}

class References : public ::testing::TestWithParam<std::string_view> {};

TEST_P(References, MeansAndPixelsAreMitsubas) {
  const auto data = shared_data();
  if (!data) GTEST_SKIP() << "the references are not beside this checkout (shared/data/scenes-with-refs)";
  const std::filesystem::path folder = *data / "scenes-with-refs";
  // The smaller references are the same images, four pixels' mean in one.
  const std::string ending = long_tests() ? "-4096.pfm" : "-4096-half128.pfm";
  const auto reference_of = [&](std::string_view name) {
    return read_pfm(folder / "ignis/references" / ("ref-" + std::string(name) + ending));
  };
  const FloatImage reference = reference_of(GetParam());
  const double their_samples = kReferenceSamples * (long_tests() ? 1 : 4);
  const std::array<double, 3> noise = wavelength_noise(reference_of("plane-d1"));

  const ReferenceScene ignis = IgnisReader(folder).read(GetParam());
  const auto parsed = proto::parse_scene(ignis.document.dump(), FilesBeside(folder), proto::Limits());
  ASSERT_TRUE(parsed) << parsed.problem().detail;
  const Estimates ours = estimate(parsed->scene, ignis.max_depth, reference.width, long_tests() ? 32 : 2);

  const std::size_t count = 3 * reference.pixels.size();
  const double limit = deviations_of(1 - std::pow(1 - 0.01, 1 / static_cast<double>(count)));  // Šidák
  std::array<double, 3> sums{};
  std::size_t apart = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double theirs = channels(reference.pixels[i / 3])[i % 3], difference = ours.mean(i) - theirs;
    sums[i % 3] += ours.mean(i);
    const double by_wavelength = noise[i % 3];
    const double their_variance = ours.variance_of_sample(i) * (1 / their_samples + by_wavelength) +
                                  by_wavelength * theirs * theirs + std::pow(theirs * 0x1p-11, 2) / 3;  // kept as half
    apart += std::abs(difference) > limit * std::sqrt(ours.variance_of_mean(i) + their_variance);
  }
  const double share = static_cast<double>(apart) / static_cast<double>(count);
  const std::array<double, 3> means_of_theirs = means(reference);
  std::printf("%-15s", std::string(GetParam()).c_str());
  for (std::size_t c = 0; c < 3; ++c) {
    const double off = sums[c] / static_cast<double>(reference.pixels.size()) / means_of_theirs[c] - 1;
    std::printf(" %+.3f%%", 100 * off);
    EXPECT_LE(std::abs(off), 0.003) << "mean of channel " << c;
  }
  std::printf("  %.3f%% of pixels apart\n", 100 * share);
  EXPECT_LE(share, 0.0025);
}

INSTANTIATE_TEST_SUITE_P(Mitsuba, References, ::testing::ValuesIn(kReferenceScenes), [](const auto& scene) {
  std::string name(scene.param);
  std::ranges::replace(name, '-', '_');
  return name;
});

}  // namespace
}  // namespace tessera
