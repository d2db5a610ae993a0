// Error against seconds of the path tracer, beside Cycles: samplers, adaptive sampling, slopes; many lights; Mray/s.
//
// tests/bench convergence [--quick] [--parts A,B] [--samples N] [--threads N]
// A part is a scene's name, "path-rates" or "many-lights". --quick takes minutes: fewer parts, 256 samples. Cycles is
// measured where Blender is installed (deploy/install-deps --bench).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "tests/benchmarks/support/error_curve.h"
#include "tests/benchmarks/support/job_peer_process.h"
#include "tests/benchmarks/support/light_renderers.h"
#include "tests/benchmarks/support/lines.h"
#include "tests/benchmarks/support/many_lights.h"
#include "tests/benchmarks/support/path_rates.h"
#include "tests/benchmarks/support/report.h"
#include "tests/benchmarks/support/svg.h"
#include "tests/benchmarks/support/work_folder.h"

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint32_t kDirectSamples = 64;  ///< At which samplers are compared on direct light.
constexpr std::uint32_t kTargetSamples = 64;  ///< Whose error adaptive sampling is asked for.
constexpr double kMeansAgree = 0.01;          ///< Otherwise the scenes aren't the same.

struct Options {
  std::string folder;
  bool is_quick = false;
  std::vector<std::string> parts;
  std::uint32_t samples = 4096;
  unsigned threads = 1;

  bool wants(const std::string& part) const { return parts.empty() || std::ranges::find(parts, part) != parts.end(); }
};

/// 1, 4, 16, … up to the most.
std::vector<std::uint32_t> sample_counts(std::uint32_t most) {
  std::vector<std::uint32_t> counts;
  for (std::uint32_t n = 1; n <= most; n *= 4) counts.push_back(n);
  return counts;
}

/// The greatest difference of the means of two images' channels, as a share of the second's.
double means_apart(const FloatImage& image, const FloatImage& other) {
  double most = 0;
  const auto a = means(image), b = means(other);
  for (std::size_t c = 0; c < 3; ++c) most = std::max(most, std::abs(a[c] / b[c] - 1));
  return most;
}

/// Pixels whose value doesn't depend on the seed: empty, or flat.
double flat_share(const FloatImage& image, const FloatImage& of_other_seed) {
  std::size_t flat = 0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const auto a = channels(image.pixels[i]), b = channels(of_other_seed.pixels[i]);
    flat += std::ranges::equal(a, b, [](double x, double y) { return std::abs(x - y) <= 1e-4 * y; });
  }
  return static_cast<double>(flat) / static_cast<double>(image.pixels.size());
}

/// What is measured of one scene.
class SceneBench {
 public:
  SceneBench(const LightScene& scene, Tessera& tessera, const fs::path& folder, const Options& options)
      : scene_(scene), tessera_(tessera), folder_(folder), options_(options) {}

  /// Prints and reports; the efficiency as a ratio to that of Cycles, where it is there.
  std::optional<double> measure(Report& report) {
    tessera_.render(scene_, {{"samples", 1}});  // builds the structure
    const LongReference reference = long_reference();
    std::vector<ErrorCurve> curves = {curve("sobol", reference), curve("independent", reference)};
    json& figures = report.figures()["scenes"][scene_.name];
    figures["what"] = scene_.what;
    if (scene_.known) {
      figures["means_off"] = means_apart(reference.image(), *scene_.known);
      report.at_most("convergence/means_off/" + scene_.name, figures["means_off"], 0.003);
    }
    std::optional<double> ratio;
    if (is_installed("blender")) {
      curves.push_back(cycles_curve(reference, figures, report));
      ratio = efficiency_ratio(curves[0], curves[2]);
      figures["efficiency_vs_cycles"] = *ratio;
      report.at_least("convergence/efficiency_vs_cycles/" + scene_.name, *ratio, 2);
    }
    for (const ErrorCurve& c : curves) figures["curves"].push_back(c.to_json());
    if (options_.samples >= 16 * kFirstFitted) {
      report.at_most("convergence/slope_off_half/" + scene_.name, std::abs(curves[1].slope() + 0.5), 0.05);
      report.at_most("convergence/slope_sobol/" + scene_.name, curves[0].slope(), -0.45);
    }
    measure_adaptive(report, reference, std::sqrt(curves[0].at(kTargetSamples)->relative_mse));
    print(curves);
    report.write_plot(plot(curves), scene_.name);
    return ratio;
  }

  /// Direct light alone, `sobol` against `independent`.
  void measure_direct(Report& report) const {
    LightScene direct = scene_;
    direct.max_depth = 2;
    const SceneBench bench(direct, tessera_, folder_, options_);
    const LongReference reference = bench.long_reference();
    const auto efficiency = [&](const char* sampler) {
      return bench.point(sampler, kDirectSamples, reference).efficiency();
    };
    const double ratio = efficiency("sobol") / efficiency("independent");
    report.figures()["scenes"][scene_.name]["sobol_over_independent_direct"] = ratio;
    report.at_least("convergence/sobol_over_independent/" + scene_.name, ratio, 2);
  }

 private:
  LongReference long_reference() const {
    const auto half = [&](int seed) {
      return tessera_.render(scene_, {{"samples", options_.samples}, {"seed", seed}}).image;
    };
    return {half(1001), half(1002)};
  }

  ErrorPoint point(const char* sampler, std::uint32_t samples, const LongReference& reference) const {
    const Rendered r = tessera_.render(scene_, {{"samples", samples}, {"sampler", sampler}, {"seed", samples}});
    return {samples, r.seconds, reference.error(r.image)};
  }

  ErrorCurve curve(const char* sampler, const LongReference& reference) const {
    ErrorCurve curve{sampler, {}};
    for (const std::uint32_t samples : sample_counts(options_.samples))
      curve.points.push_back(point(sampler, samples, reference));
    return curve;
  }

  /// Against Cycles' own long reference, which is compared with ours.
  ErrorCurve cycles_curve(const LongReference& ours, json& figures, Report& report) const {
    const std::vector<std::uint32_t> counts = sample_counts(options_.samples);
    std::vector<CyclesRun> runs = {{options_.samples, 1001}, {options_.samples, 1002}};
    for (const std::uint32_t samples : counts) runs.push_back({samples, samples});
    const std::vector<Rendered> rendered = render_with_cycles(scene_, folder_, options_.threads, runs);
    const LongReference theirs(rendered[0].image, rendered[1].image);
    figures["cycles_means_off"] = means_apart(theirs.image(), ours.image());
    report.at_most("convergence/cycles_means_off/" + scene_.name, figures["cycles_means_off"], kMeansAgree);
    ErrorCurve curve{"Cycles", {}};
    for (std::size_t i = 0; i < counts.size(); ++i)
      curve.points.push_back({counts[i], rendered[i + 2].seconds, theirs.error(rendered[i + 2].image)});
    return curve;
  }

  /// Seconds to an error, block by block or everywhere alike.
  void measure_adaptive(Report& report, const LongReference& reference, double error) {
    const auto efficiency = [&](bool is_adaptive) {
      const json until = {{"error", error}, {"samples", options_.samples}};
      const Rendered r = tessera_.render(scene_, {{"until", until}, {"adaptive", is_adaptive}, {"seed", 5}});
      return 1 / (reference.error(r.image) * r.seconds);
    };
    const auto seeded = [&](int seed) { return tessera_.render(scene_, {{"samples", 16}, {"seed", seed}}).image; };
    flat_share_ = flat_share(seeded(6), seeded(7));
    adaptive_ratio_ = efficiency(true) / efficiency(false);
    auto& figures = report.figures()["scenes"][scene_.name];
    figures["flat_share"] = flat_share_;
    figures["adaptive_over_not"] = adaptive_ratio_;
    report.at_least("convergence/adaptive/" + scene_.name, adaptive_ratio_, flat_share_ >= 0.5 ? 1.5 : 0.95);
  }

  void print(const std::vector<ErrorCurve>& curves) const {
    std::vector<std::vector<std::string>> rows = {{scene_.name}};
    std::vector<std::string> slopes = {"slope of RMSE"};
    for (const ErrorCurve& c : curves) {
      rows[0].insert(rows[0].end(), {c.renderer + " s", "relMSE", "1/(s relMSE)"});
      slopes.insert(slopes.end(), {"", fixed(c.slope(), 3), ""});
    }
    for (const ErrorPoint& p : curves.front().points) {
      std::vector<std::string> row = {std::to_string(p.samples)};
      for (const ErrorCurve& c : curves)
        if (const ErrorPoint* at = c.at(p.samples))
          row.insert(row.end(),
                     {three_digits(at->seconds), scientific(at->relative_mse), three_digits(at->efficiency())});
      rows.push_back(std::move(row));
    }
    rows.push_back(std::move(slopes));
    print_table(rows);
    std::printf("adaptive over not: %.2f, %.0f%% of the pixels empty or flat\n", adaptive_ratio_, 100 * flat_share_);
  }

  static std::string scientific(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2e", value);
    return text;
  }

  std::string plot(const std::vector<ErrorCurve>& curves) const {
    LineChart chart{scene_.name + ": " + scene_.what, power_of_ten_text, {}};
    for (std::size_t i = 0; i < curves.size(); ++i) {
      Line line{curves[i].renderer, kColors[i], curves[i].renderer == "Cycles" ? "6 4" : "none", {}};
      for (const ErrorPoint& p : curves[i].points)
        if (p.relative_mse > 0) line.points.push_back({p.seconds, std::sqrt(p.relative_mse)});
      chart.lines.push_back(std::move(line));
    }
    return line_charts("Error against seconds", "Square root of relMSE; a point for 1, 4, 16, … samples a pixel",
                       "processor seconds", {chart});
  }

  const LightScene& scene_;
  Tessera& tessera_;
  const fs::path& folder_;
  const Options& options_;
  double flat_share_ = 0, adaptive_ratio_ = 0;
};

void measure(Report& report, const Options& options) {
  std::printf(
      "\nPath tracing of %u × %u pixels on %u threads, processor seconds of rendering. relMSE: the mean of\n"
      "(I − R)² / (R² + 0.01), each renderer against its own reference of 2 × %u samples, whose own error is taken\n"
      "off. Cycles: same depth, box filter, no denoiser, no adaptive sampling, nothing clamped or filtered.\n",
      kLightSide, kLightSide, options.threads, options.samples);
  if (!is_installed("blender"))
    std::printf("Blender is missing (deploy/install-deps --bench brings it): Tessera is measured alone.\n");
  const WorkFolder folder("convergence");
  Tessera tessera(TESSERAD, folder.path(), options.threads);
  std::vector<double> ratios;
  std::optional<LightScene> kitchen;
  for (const LightScene& scene : light_scenes(folder.path())) {
    if (scene.name == "kitchen") kitchen = scene;
    if (!options.wants(scene.name)) continue;
    SceneBench bench(scene, tessera, folder.path(), options);
    if (const auto ratio = bench.measure(report)) ratios.push_back(*ratio);
    for (const char* with_soft_light : {"cbox-d6", "product", "kitchen"})
      if (scene.name == with_soft_light) bench.measure_direct(report);
  }
  if (!ratios.empty()) report.at_least("convergence/efficiency_vs_cycles_mean", geometric_mean(ratios), 3);
  if (options.wants("path-rates")) {
    Tessera one_thread(TESSERAD, folder.path(), 1);
    measure_path_rates(report, organic_scene(folder.path()), folder.path(), one_thread);
    if (kitchen) measure_path_rates(report, *kitchen, folder.path(), one_thread);
  }
  if (options.wants("many-lights")) measure_many_lights(report, folder.path(), tessera);
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera;
  bench::Options options;
  CLI::App app("Measures how the path tracer's error falls, beside Cycles.", "tests/bench convergence");
  app.add_option("folder", options.folder, "where JSON and plots go; tests/bench gives it")->required();
  app.add_flag("--quick", options.is_quick, "a few parts, up to 256 samples");
  app.add_option("--parts", options.parts, "only these")->delimiter(',');
  app.add_option("--samples", options.samples, "the most in a curve; 64 or more")
      ->check(CLI::Range(bench::kTargetSamples, 1U << 20));
  app.add_option("--threads", options.threads)->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  if (options.is_quick) {
    if (app.count("--samples") == 0) options.samples = 256;
    if (options.parts.empty())
      options.parts = {"cbox-d6", "emissive-plane", "product", "kitchen", "lamps-2400", "path-rates", "many-lights"};
  }
  try {
    bench::Report report("convergence", options.folder);
    bench::measure(report, options);
    report.finish();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_convergence: %s\n", error.what());
    return 1;
  }
}
