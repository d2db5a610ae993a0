// Ignis' scenes beside Mitsuba's references of 4096 samples: means, and a test of every pixel.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

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

/// What independent renders of a square image say of each pixel's channel: the mean of all, and the variance of one
/// sample.
class Estimates {
 public:
  explicit Estimates(std::uint32_t side) : side_(side), sums_(3 * std::size_t{side} * side), squares_(sums_.size()) {}

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
  /// The greater of what the pixel's own samples tell, who may have missed what is rare there, and of what those of the
  /// pixels around do on average.
  double variance_of_sample(std::size_t i) const {
    const std::int64_t x = i / 3 % side_, y = i / 3 / side_, c = i % 3;
    double sum = 0, count = 0;
    for (std::int64_t v = std::max<std::int64_t>(y - 1, 0); v <= std::min<std::int64_t>(y + 1, side_ - 1); ++v)
      for (std::int64_t u = std::max<std::int64_t>(x - 1, 0); u <= std::min<std::int64_t>(x + 1, side_ - 1);
           ++u, ++count)
        sum += own_variance(static_cast<std::size_t>(3 * (v * side_ + u) + c));
    return std::max(own_variance(i), sum / count);
  }
  double samples() const { return static_cast<double>(renders_) * samples_; }

 private:
  double own_variance(std::size_t i) const {
    return std::max(0.0, squares_[i] / renders_ - mean(i) * mean(i)) * renders_ / (renders_ - 1) * samples_;
  }

  std::int64_t side_;
  std::vector<double> sums_, squares_;
  int renders_ = 0, samples_ = 0;
};

/// What the scene says, as Mitsuba renders it.
class Renderer {
 public:
  Renderer(const ReferenceScene& ignis, const std::filesystem::path& folder, std::uint32_t side) {
    auto parsed = proto::parse_scene(ignis.document.dump(), FilesBeside(folder), proto::Limits());
    if (!parsed) throw std::runtime_error(parsed.problem().detail);
    scene_ = parsed->scene;
    settings_.width = settings_.height = side;
    settings_.max_depth = ignis.max_depth;
    settings_.integrator = IntegratorKind::path;
  }

  std::vector<Rgb> render(SamplerKind sampler, std::uint32_t samples, std::uint64_t seed) const {
    Settings settings = settings_;
    settings.sampler = sampler;
    settings.samples = samples;
    settings.seed = seed;
    return render_image(scene_, *scene_->camera, settings, 2).pixels.color;
  }

 private:
  std::shared_ptr<const Scene> scene_;
  Settings settings_;
};

/// Mitsuba carried light by wavelengths: even where every sample is alike there is noise. That of plane-d6, whose sky
/// is 1 and whose floor, which sees nothing but sky, has its reflectance: the variance by channel, as a share of the
/// square; the greater of the two, as it depends on the colour.
std::array<double, 3> wavelength_noise(const FloatImage& plane) {
  struct Part {
    double x0, y0, x1, y1;
    Rgb truth;
  };
  std::array<double, 3> most{};
  for (const Part& part :
       {Part{0, 0, 1, 0.125, {1, 1, 1}}, Part{0.4, 0.83, 0.6, 0.9, {0.885809F, 0.698859F, 0.666422F}}}) {
    std::array<double, 3> sums{};
    double count = 0;
    for (auto y = static_cast<std::uint32_t>(part.y0 * plane.height); y < part.y1 * plane.height; ++y)
      for (auto x = static_cast<std::uint32_t>(part.x0 * plane.width); x < part.x1 * plane.width; ++x, ++count)
        for (std::size_t c = 0; c < 3; ++c)
          sums[c] +=
              std::pow(channels(plane.pixels[std::size_t{y} * plane.width + x])[c] / channels(part.truth)[c] - 1, 2);
    for (std::size_t c = 0; c < 3; ++c) most[c] = std::max(most[c], sums[c] / count);
  }
  return most;
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
  const std::array<double, 3> noise = wavelength_noise(reference_of("plane-d6"));

  const ReferenceScene ignis = IgnisReader(folder).read(GetParam());
  const Renderer renderer(ignis, folder, reference.width);
  const std::uint32_t samples = long_tests() ? 1024 : 128;
  const auto off = [&, means_of_theirs = means(reference)](const std::vector<Rgb>& pixels, std::size_t c) {
    return means({reference.width, reference.height, pixels})[c] / means_of_theirs[c] - 1;
  };
  // By the sampler that has less noise.
  const std::vector<Rgb> well_spread = renderer.render(SamplerKind::sobol, samples, 0);
  Estimates ours(reference.width);
  for (std::uint32_t i = 0; i < kRenders; ++i)
    ours.add(renderer.render(SamplerKind::independent, samples / kRenders, i), static_cast<int>(samples / kRenders));

  const std::size_t count = 3 * reference.pixels.size();
  const double limit = deviations_of(1 - std::pow(1 - 0.01, 1 / static_cast<double>(count)));  // Šidák
  std::size_t apart = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double theirs = channels(reference.pixels[i / 3])[i % 3], difference = ours.mean(i) - theirs;
    const double by_wavelength = noise[i % 3];
    const double of_sample = ours.variance_of_sample(i);
    const double their_variance = of_sample * (1 / their_samples + by_wavelength) + by_wavelength * theirs * theirs +
                                  std::pow(theirs * 0x1p-11, 2) / 3;  // kept as half
    apart += std::abs(difference) > limit * std::sqrt(of_sample / ours.samples() + their_variance);
  }
  const double share = static_cast<double>(apart) / static_cast<double>(count);
  std::printf("%-15s", std::string(GetParam()).c_str());
  for (std::size_t c = 0; c < 3; ++c) {
    std::printf(" %+.3f%%", 100 * off(well_spread, c));
    // Seen alone, the lamp's three means tell one area, but theirs don't: the blue one is too dark by 0.3%
    // (`KnownArea`).
    if (GetParam() == "cbox-d1" && c == 2) continue;
    EXPECT_LE(std::abs(off(well_spread, c)), 0.003) << "mean of channel " << c;
  }
  std::printf("  %.3f%% of pixels apart\n", 100 * share);
  EXPECT_LE(share, 0.0025);
}

TEST(KnownArea, OfTheLampThatIsSeenAlone) {
  const auto data = shared_data();
  if (!data) GTEST_SKIP() << "the scenes are not beside this checkout (shared/data/scenes-with-refs)";
  const std::filesystem::path folder = *data / "scenes-with-refs";
  const std::vector<Rgb> pixels =
      Renderer(IgnisReader(folder).read("cbox-d1"), folder, 128).render(SamplerKind::sobol, 1024, 0);
  // A rectangle 130 wide between 1027 and 1132 from the camera, 275.3 above it: its picture is a trapezoid.
  const double plane = std::tan(39.3077 / 2 * std::numbers::pi / 180), above = 548.79999 - 0.5 - 273;
  const double height = above / (1027 * plane) - above / (1132 * plane);
  const double share = height * (130 / (1027 * plane) + 130 / (1132 * plane)) / 2 / 4;
  const std::array<double, 3> ours = means({128, 128, pixels}), radiance = {18.387, 10.9873, 2.75357};
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(ours[c] / (share * radiance[c]), 1, 5e-4);
}

INSTANTIATE_TEST_SUITE_P(Mitsuba, References, ::testing::ValuesIn(kReferenceScenes), [](const auto& scene) {
  std::string name(scene.param);
  std::ranges::replace(name, '-', '_');
  return name;
});

}  // namespace
}  // namespace tessera
