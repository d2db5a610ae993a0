// Time per ray against error in t and in the hit set, by an oracle of wider precision, for every structure × bound.
//
// tests/bench error [PART]: with PART only the scenes whose name contains it.
#include <algorithm>
#include <cstdio>
#include <exception>

#include "tests/benchmarks/support/error_scenes.h"
#include "tests/benchmarks/support/hit_errors.h"
#include "tests/benchmarks/support/plain_float.h"
#include "tests/benchmarks/support/ray_sample.h"
#include "tests/benchmarks/support/report.h"
#include "tests/benchmarks/support/samples.h"
#include "tests/benchmarks/support/scatter.h"
#include "tests/benchmarks/support/structure_choices.h"
#include "tests/benchmarks/support/svg.h"

namespace tessera::bench {
namespace {

constexpr int kRepetitions = 3;
constexpr double kTraceSeconds = 0.1;
constexpr const char* kContrast = "float brute (contrast)";

/// What is measured of one structure, or of the contrast.
struct Row {
  std::string label, color;
  std::unique_ptr<const Accel> accel;
  bool is_contrast = false;
  HitErrors errors{};
  Samples ns_per_ray{};
};

/// All structures over one scene, the fastest first.
std::vector<Row> measure(const ErrorScene& scene) {
  std::vector<Row> rows;
  for (const StructureChoice& choice : structure_choices())
    rows.push_back({choice.label, color_of(choice.options.kind), make_accel(scene.scene, choice.options)});
  if (auto contrast = PlainFloat::make(*scene.scene)) rows.push_back({kContrast, "#222", std::move(contrast), true});
  const auto truth = true_answers(*scene.scene, scene.rays);
  for (Row& row : rows) row.errors = hit_errors(*row.accel, scene.rays, truth);
  const RaySample sample{scene.name, false, 0, scene.rays};
  for (int i = 0; i < kRepetitions; ++i)
    for (Row& row : rows) row.ns_per_ray.add(1e9 * seconds_per_ray(*row.accel, sample, kTraceSeconds));
  std::ranges::sort(rows, {}, [](const Row& row) { return row.ns_per_ray.median(); });
  return rows;
}

void print(const ErrorScene& scene, const std::vector<Row>& rows) {
  std::printf("\n%s: %s; %zu rays\n", scene.name.c_str(), scene.what.c_str(), scene.rays.size());
  std::vector<std::vector<std::string>> table = {{"structure", "ns/ray", "t max ulp", "mean", "t max M·2^-24", "mean",
                                                  "missed", "invented", "wrong primitive", "boundary"}};
  for (const Row& row : rows) {
    const HitErrors& e = row.errors;
    table.push_back({row.label, with_spread(row.ns_per_ray), three_digits(e.max_ulp), three_digits(e.mean_ulp),
                     three_digits(e.max_reach), three_digits(e.mean_reach), std::to_string(e.missed),
                     std::to_string(e.invented), std::to_string(e.wrong_primitive), std::to_string(e.boundary)});
  }
  print_table(table);
}

void report_figures(Report& report, const ErrorScene& scene, const std::vector<Row>& rows) {
  auto& json = report.figures()["scenes"][scene.name];
  json["what"] = scene.what;
  json["rays"] = scene.rays.size();
  std::uint64_t wrong = 0;
  const HitErrors* first = nullptr;
  int differing = 0;
  for (const Row& row : rows) {
    const HitErrors& e = row.errors;
    json["structures"].push_back({{"structure", row.label},
                                  {"is_contrast", row.is_contrast},
                                  {"ns_per_ray", row.ns_per_ray.to_json()},
                                  {"t_error_ulp", {{"max", e.max_ulp}, {"mean", e.mean_ulp}}},
                                  {"t_error_of_reach", {{"max", e.max_reach}, {"mean", e.mean_reach}}},
                                  {"missed", e.missed},
                                  {"invented", e.invented},
                                  {"wrong_primitive", e.wrong_primitive},
                                  {"boundary", e.boundary}});
    if (row.is_contrast) continue;
    wrong = std::max(wrong, e.wrong());
    if (!first) first = &e;
    differing += e == *first ? 0 : 1;
  }
  report.at_most("wrong_hits/" + scene.name, static_cast<double>(wrong), 0);
  report.at_most("structures_that_differ/" + scene.name, differing, 0);
}

std::string note(const std::string& who, const HitErrors& e) {
  if (e.wrong() == 0) return who + ": every hit right";
  return who + ": " + std::to_string(e.missed) + " missed, " + std::to_string(e.invented) + " invented, " +
         std::to_string(e.wrong_primitive) + " wrong";
}

ScatterPanel panel(const ErrorScene& scene, const std::vector<Row>& rows) {
  ScatterPanel panel{scene.name, scene.what, {}, {}};
  // What is exact to the last bit of a wider type still has a place on a logarithmic axis.
  constexpr double kLeastUlp = 0.1;
  const HitErrors* ours = nullptr;
  for (const Row& row : rows) {
    const bool is_fastest = ours == nullptr && !row.is_contrast;
    panel.dots.push_back({row.is_contrast ? "plain float"
                          : is_fastest    ? row.label
                                          : "",
                          row.color, 1e-9 * row.ns_per_ray.median(), std::max(row.errors.max_ulp, kLeastUlp),
                          row.is_contrast});
    if (row.is_contrast) panel.notes.push_back(note("Plain float", row.errors));
    if (!row.is_contrast && (!ours || row.errors.wrong() > ours->wrong())) ours = &row.errors;
  }
  if (ours) panel.notes.insert(panel.notes.begin(), note("Tessera", *ours));
  return panel;
}

void measure_errors(Report& report, const std::string& part) {
  std::printf(
      "\nOne thread, processor time; medians of %d interleaved repetitions. t: |t - true t| where the primitive is\n"
      "right, in units of the last place, and as a distance against M·2^-24, M being the reach of the scene from the\n"
      "ray's origin. Boundary: disagreements where an edge or silhouette lies within the rounding of double; they\n"
      "count in no other column.\n",
      kRepetitions);
  std::vector<ScatterPanel> panels;
  for (const ErrorScene& scene : error_scenes()) {
    if (scene.name.find(part) == std::string::npos) continue;
    const std::vector<Row> rows = measure(scene);
    print(scene, rows);
    report_figures(report, scene, rows);
    panels.push_back(panel(scene, rows));
  }
  std::vector<LegendEntry> legend;
  for (const AccelEntry& row : accel_table()) legend.push_back({std::string(row.name), color_of(row.kind)});
  report.write_plot(scatter_chart(
      "Time per ray against error, on scenes that are hard on rounding",
      "Every structure × bound gives the same bits, so only time tells them apart. Plain "
      "float: brute force after Möller & Trumbore, for contrast.",
      "Up: the greatest error of t in units of the last place. Across: time per ray. Wrong: not the nearest primitive.",
      legend, panels));
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "usage: bench_error FOLDER [PART_OF_A_SCENE'S_NAME]\n");
    return 2;
  }
  try {
    tessera::bench::Report report("error", argv[1]);
    tessera::bench::measure_errors(report, argc == 3 ? argv[2] : "");
    report.finish();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_error: %s\n", error.what());
    return 1;
  }
}
