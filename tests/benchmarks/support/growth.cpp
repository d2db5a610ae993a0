#include "tests/benchmarks/support/growth.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "tests/benchmarks/support/lines.h"
#include "tests/benchmarks/support/structure_bench.h"
#include "tests/benchmarks/support/svg.h"
#include "tests/benchmarks/support/terrain.h"
#include "tests/support/scenes.h"

namespace tessera::bench {
namespace {

constexpr std::array<std::uint32_t, 4> kSizes = {1'000, 10'000, 100'000, 1'000'000};
constexpr std::size_t kRays = 1 << 15;
constexpr int kRepetitions = 3;
/// A build that a structure's last one makes expect to take longer isn't begun.
constexpr double kLongestBuildSeconds = 15;

/// What a structure takes for one number of triangles.
struct Measured {
  double triangles = 0;
  Samples build_ms, mrays;
  double bytes = 0;
};

/// One structure as the terrain grows.
struct Growth {
  StructureChoice choice;
  std::vector<Measured> sizes;
  bool stopped = false;
};

/// By n log n, with a margin for caches that no longer hold it all.
double expected_build_seconds(const Growth& growth, double triangles) {
  if (growth.sizes.empty()) return 0;
  const Measured& last = growth.sizes.back();
  return 1e-3 * last.build_ms.median() * triangles / last.triangles * 1.3;
}

using Points = std::vector<std::array<double, 2>>;
using Value = double (*)(const Measured&);
constexpr Value kBuildSeconds = [](const Measured& m) { return 1e-3 * m.build_ms.median(); };
constexpr Value kBytes = [](const Measured& m) { return m.bytes; };
constexpr Value kRaySeconds = [](const Measured& m) { return 1e-6 / m.mrays.median(); };

Points points(const Growth& growth, Value value) {
  Points out;
  for (const Measured& m : growth.sizes) out.push_back({m.triangles, value(m)});
  return out;
}

/// The slope of the least-squares line through the logarithms. Precondition: at least two points.
double exponent(const Points& points) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const auto n = static_cast<double>(points.size());
  for (const auto& [x, y] : points) {
    const double lx = std::log(x), ly = std::log(y);
    sx += lx;
    sy += ly;
    sxx += lx * lx;
    sxy += lx * ly;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

/// Adds the next size to every structure that hasn't stopped.
void grow(std::vector<Growth>& structures, std::uint32_t size) {
  TriangleMesh mesh = terrain(size);
  const auto triangles = static_cast<double>(mesh.triangles.size());
  const auto scene = SceneBuilder().add(std::move(mesh)).build();
  const std::vector<RaySample> rays = {random_segments(*scene, kRays, 1)};
  std::vector<std::pair<Growth*, StructureBench>> taking_part;
  for (Growth& growth : structures) {
    if (growth.stopped) continue;
    growth.stopped = expected_build_seconds(growth, triangles) > kLongestBuildSeconds;
    if (growth.stopped)
      std::printf("%s stops at %.0f triangles: building over %.0f would take more than %.0f s.\n",
                  growth.choice.label.c_str(), growth.sizes.back().triangles, triangles, kLongestBuildSeconds);
    else
      taking_part.emplace_back(&growth, StructureBench(growth.choice, scene, rays));
  }
  for (int i = 0; i < kRepetitions; ++i)
    for (auto& [growth, bench] : taking_part) bench.repeat();
  for (const auto& [growth, bench] : taking_part)
    growth->sizes.push_back(
        {triangles, bench.build_ms(), *bench.mrays("random"), static_cast<double>(bench.stats().bytes)});
}

void print(const std::vector<Growth>& structures) {
  std::vector<std::vector<std::string>> rows = {{"structure", "build at 10^3", "10^4", "10^5", "10^6", "~ N^",
                                                 "bytes at 10^5", "~ N^", "ray at 10^3", "10^4", "10^5", "10^6",
                                                 "~ N^"}};
  for (const Growth& growth : structures) {
    std::vector<std::string>& row = rows.emplace_back();
    row.push_back(growth.choice.label);
    const auto times = [&](Value value) {
      for (std::size_t i = 0; i < kSizes.size(); ++i)
        row.push_back(i < growth.sizes.size() ? short_time(value(growth.sizes[i])) : "-");
      row.push_back(fixed(exponent(points(growth, value)), 2));
    };
    times(kBuildSeconds);
    row.push_back(growth.sizes.size() > 2 ? short_bytes(growth.sizes[2].bytes) : "-");
    row.push_back(fixed(exponent(points(growth, kBytes)), 2));
    times(kRaySeconds);
  }
  print_table(rows);
}

void report_figures(Report& report, const std::vector<Growth>& structures) {
  for (const Growth& growth : structures) {
    auto& json = report.figures()["growth"][growth.choice.label];
    json["exponents"] = {{"build", exponent(points(growth, kBuildSeconds))},
                         {"bytes", exponent(points(growth, kBytes))},
                         {"ray", exponent(points(growth, kRaySeconds))}};
    for (const Measured& m : growth.sizes)
      json["sizes"].push_back({{"triangles", m.triangles},
                               {"build_ms", m.build_ms.to_json()},
                               {"bytes", m.bytes},
                               {"mrays_random", m.mrays.to_json()}});
  }
}

std::string plot(const std::vector<Growth>& structures) {
  std::vector<LineChart> charts = {{"Build", short_time, {}}, {"Memory", short_bytes, {}}, {"A ray", short_time, {}}};
  constexpr std::array kValues = {kBuildSeconds, kBytes, kRaySeconds};
  constexpr std::array kDashes = {"none", "8 3", "2 3", "1 2", "8 3 2 3"};
  for (std::size_t chart = 0; chart < charts.size(); ++chart) {
    AccelKind last = AccelKind::automatic;
    std::size_t of_kind = 0;
    for (const Growth& growth : structures) {
      of_kind = growth.choice.options.kind == last ? of_kind + 1 : 0;
      last = growth.choice.options.kind;
      charts[chart].lines.push_back(
          {growth.choice.label, color_of(last), kDashes[of_kind % kDashes.size()], points(growth, kValues[chart])});
    }
  }
  return line_charts("How structures grow with the scene",
                     "A terrain of a thousand to a million triangles, one thread; rays are random segments through its "
                     "box. Both axes logarithmic.",
                     "triangles", charts);
}

}  // namespace

void measure_growth(Report& report) {
  std::vector<Growth> structures;
  for (const StructureChoice& choice : structure_choices())
    // A list is here with one bound only, for contrast: its groups of √n are all that grows.
    if (choice.options.kind != AccelKind::bounds || choice.options.bound == BoundKind::box)
      structures.push_back({choice, {}, false});
  std::printf("\nGrowth: a terrain of N triangles, random segments through its box, one thread.\n");
  for (const std::uint32_t size : kSizes) grow(structures, size);
  print(structures);
  report_figures(report, structures);
  report.write_plot(plot(structures), "growth");
}

}  // namespace tessera::bench
