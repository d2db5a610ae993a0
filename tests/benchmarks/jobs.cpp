// Whole jobs, from start to written image, beside Tachyon and POV-Ray; where a job's time goes, and how it grows.
//
// tests/bench jobs [PART]: with PART only the scenes whose name contains it ("100k", "1600k"). Tachyon and POV-Ray are
// measured where they are installed (deploy/install-deps --bench).
#include <algorithm>
#include <cstdio>
#include <exception>
#include <functional>
#include <utility>

#include "tests/benchmarks/support/daemon_process.h"
#include "tests/benchmarks/support/job_costs.h"
#include "tests/benchmarks/support/job_peer_process.h"
#include "tests/benchmarks/support/job_peer_scene.h"
#include "tests/benchmarks/support/report.h"
#include "tests/benchmarks/support/work_folder.h"

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;

constexpr int kRepetitions = 3;
constexpr double kBar = 3;  ///< A peer's wall time over ours.
const std::string kSide = "1024";

/// Start the daemon, have the client render the scene to a PNG. The daemon's end isn't counted: the image is there.
double run_tessera(const fs::path& scene, int samples) {
  const Stopwatch watch;
  const DaemonProcess daemon(TESSERAD, {"--threads", "2"});
  const fs::path image = scene.string() + ".png";
  seconds_to_run({TESSERA, "--server", client::to_url(daemon.address()), "render", scene, "-o", image, "--size",
                  kSide + "x" + kSide, "--spp", std::to_string(samples)},
                 scene.string() + ".log");
  return watch.seconds();
}

/// Uncompressed Targa, its default.
double run_tachyon(const fs::path& scene, int samples) {
  return seconds_to_run({"tachyon", scene, "-res", kSide, kSide, "-numthreads", "2", "-aasamples",
                         std::to_string(samples - 1), "-o", scene.string() + ".tga"},
                        scene.string() + ".log");
}

/// Uncompressed PPM. Several samples: a grid of them in every pixel that differs from its neighbours at all.
double run_povray(const fs::path& scene, int samples) {
  std::vector<std::string> command = {
      "povray", "+I" + scene.string(), "+O" + scene.string() + ".ppm", "+FP", "+W" + kSide, "+H" + kSide, "+WT2", "-D",
      "-GA"};
  if (samples == 1)
    command.push_back("-A");
  else
    command.insert(command.end(), {"+A0.0", "+AM1", "+R4", "-J"});
  return seconds_to_run(command, scene.string() + ".log");
}

struct Contender {
  std::string name;
  fs::path scene;
  double (*run)(const fs::path& scene, int samples);
  Samples seconds{};
};

void race(Report& report, const JobScene& scene, const fs::path& folder) {
  std::vector<Contender> entered = {{"tessera (obj)", write_for_tessera(scene, folder, "obj"), run_tessera},
                                    {"tessera (ply)", write_for_tessera(scene, folder, "ply"), run_tessera}};
  if (is_installed("tachyon")) entered.push_back({"tachyon", write_for_tachyon(scene, folder), run_tachyon});
  if (is_installed("povray")) entered.push_back({"povray", write_for_povray(scene, folder), run_povray});
  for (const int samples : {1, 16}) {
    std::vector<Contender> contenders = entered;
    // Interleaved: whatever else the machine does meets every program alike.
    for (int i = 0; i < kRepetitions; ++i)
      for (Contender& c : contenders) c.seconds.add(c.run(c.scene, samples));
    const double ours = contenders[0].seconds.median();
    const std::string job = scene.name + "_" + std::to_string(samples) + "spp";
    std::vector<std::vector<std::string>> rows = {{job, "s", "over ours"}};
    for (const Contender& c : contenders) {
      rows.push_back({c.name, with_spread(c.seconds, 2), fixed(c.seconds.median() / ours, 2)});
      report.figures()["jobs"][job][c.name] = c.seconds.to_json();
    }
    print_table(rows);
    for (const Contender& c : contenders)
      if (c.run != run_tessera) report.at_least("jobs_" + job + "_vs_" + c.name, c.seconds.median() / ours, kBar);
  }
}

void measure(Report& report, const std::string& name_part) {
  std::printf(
      "\nA diffuse body on a ground, one point light, shadows: %s x %s pixels, two threads. Wall seconds from start "
      "to\n"
      "written image; ours with the daemon's start and the client's end, the mesh as OBJ (which counts) or binary "
      "PLY.\n"
      "Medians of %d interleaved repetitions, ± half the distance between the quartiles.\n",
      kSide.c_str(), kSide.c_str(), kRepetitions);
  const WorkFolder folder("jobs");
  for (const auto& [name, triangles] : {std::pair{"100k", 100'000U}, std::pair{"1600k", 1'600'000U}}) {
    if (std::string(name).find(name_part) == std::string::npos) continue;
    const JobScene scene = job_scene(name, triangles);
    race(report, scene, folder.path());
    for (const std::uint32_t samples : {1U, 16U})
      measure_job_costs(report, name + ("_" + std::to_string(samples)) + "spp",
                        write_for_tessera(scene, folder.path(), "obj"), samples, TESSERAD);
  }
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "usage: bench_jobs FOLDER [PART_OF_A_SCENE'S_NAME]\n");
    return 2;
  }
  try {
    tessera::bench::Report report("jobs", argv[1]);
    tessera::bench::measure(report, argc == 3 ? argv[2] : "");
    report.finish();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_jobs: %s\n", error.what());
    return 1;
  }
}
