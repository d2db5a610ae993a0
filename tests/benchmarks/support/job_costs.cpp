#include "tests/benchmarks/support/job_costs.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <thread>

#include "client/client.h"
#include "client/job_document.h"
#include "client/scene_files.h"
#include "core/io/image_io.h"
#include "proto/parse.h"
#include "server/jobs/job.h"
#include "server/work/scheduler.h"
#include "tests/benchmarks/support/daemon_process.h"
#include "tests/benchmarks/support/render_image.h"
#include "tests/support/files_beside.h"
#include "tests/support/list_schedule.h"

namespace tessera::bench {
namespace {

constexpr std::uint32_t kSide = 1024;
constexpr int kRepetitions = 3;

nlohmann::json document_of(const std::filesystem::path& scene, std::uint32_t samples) {
  client::JobOptions options;
  options.size = {kSide, kSide};
  options.samples = samples;
  return client::job_document(scene, options);
}

/// Milliseconds of the steps of a job, by their names, in order.
class Steps {
 public:
  void add(const std::string& name, double seconds) {
    const auto known = std::ranges::find(steps_, name, [](const auto& step) { return step.first; });
    auto& step = known == steps_.end() ? steps_.emplace_back(name, Samples()) : *known;
    step.second.add(1e3 * seconds);
  }

  void print(const std::string& title) const {
    std::vector<std::vector<std::string>> rows = {{title, "ms"}};
    for (const auto& [name, ms] : steps_) rows.push_back({name, with_spread(ms, 1)});
    print_table(rows);
  }

  nlohmann::json to_json() const {
    nlohmann::json json;
    for (const auto& [name, ms] : steps_) json[name] = ms.to_json();
    return json;
  }

 private:
  std::vector<std::pair<std::string, Samples>> steps_;
};

/// Asks seldom: answering takes processor time from the job's threads.
proto::JobStatus wait_for(const client::Client& client, proto::JobStatus status) {
  while (!proto::has_ended(status.state)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    status = client.status(status.id);
  }
  if (status.state != proto::JobState::completed) throw std::runtime_error("the job failed: " + status.error);
  return status;
}

/// A cold job's steps as the client does them, but for how often it asks; the daemon's own seconds for the job.
double run_steps(const std::filesystem::path& scene, std::uint32_t samples, const std::filesystem::path& tesserad,
                 unsigned threads, Steps& steps) {
  Stopwatch watch;
  const auto step = [&](const char* name) {
    steps.add(name, watch.seconds());
    watch = Stopwatch();
  };
  const DaemonProcess daemon(tesserad, {"--threads", std::to_string(threads)});
  const client::Client client(daemon.address());
  step("start the daemon");
  nlohmann::json job = document_of(scene, samples);
  const client::NamedFiles files = client::name_files_by_content(job, {.folder = client::folder_of(scene)});
  step("hash the mesh's file");
  for (const client::LocalFile& file : files.to_upload) client.upload(file.path, file.hash);
  step("upload it");
  const proto::JobStatus submitted = client.submit(job);
  step("parse the scene and the mesh");
  const proto::JobStatus ended = wait_for(client, submitted);
  const nlohmann::json stats = client.stats(ended.id);
  steps.add("plan", stats["timing"]["preparing"]);
  steps.add("render", stats["timing"]["rendering"]);
  steps.add("... of that, build the structure", stats["structure"]["build_seconds"]);
  watch = Stopwatch();
  const std::string image = client.fetch(ended.id, {});
  step("encode and fetch the image");
  std::ofstream(scene.string() + ".png", std::ios::binary) << image;
  step("write it");
  return stats["timing"]["total"];
}

void measure_steps(Report& report, const std::string& job, const std::filesystem::path& scene, std::uint32_t samples,
                   const std::filesystem::path& tesserad) {
  Steps one_thread, two_threads;
  Samples ratio;
  for (int i = 0; i < kRepetitions; ++i) {
    const double one = run_steps(scene, samples, tesserad, 1, one_thread);
    ratio.add(one / run_steps(scene, samples, tesserad, 2, two_threads));
  }
  two_threads.print(job + ", cold, two threads");
  std::printf("on two threads %s times as fast as on one, from parsed to rendered\n", with_spread(ratio, 3).c_str());
  report.figures()["steps_ms"][job] = two_threads.to_json();
  report.figures()["two_threads"][job] = ratio.to_json();
  report.at_least("jobs_two_threads/" + job, ratio.median(), 1.93);
}

RenderContext context_of(const std::filesystem::path& scene, std::uint32_t samples) {
  const std::string document = document_of(scene, samples)["scene"].dump();
  const auto parsed = proto::parse_scene(document, FilesBeside(scene.parent_path()), {});
  if (!parsed) throw std::runtime_error("the scene is refused: " + parsed.problem().detail);
  Settings settings;
  settings.width = settings.height = kSide;
  settings.samples = samples;
  return prepare(parsed->scene, *parsed->scene->camera, settings);
}

/// Each tile's processor seconds, one after the other on this thread; and its pixels.
std::vector<double> tile_seconds(const RenderContext& context, std::vector<TileResult>& tiles) {
  std::vector<double> seconds;
  for (std::size_t i = 0; i < context.plan.tiling.tiles.size(); ++i) {
    const CpuStopwatch watch;
    tiles.push_back(*render_tile(context, i));
    seconds.push_back(watch.seconds());
  }
  return seconds;
}

/// Processor milliseconds of what the daemon does with a job's tiles beside rendering them.
struct AroundTiles {
  Samples film;     ///< Making it, and the system giving it memory.
  Samples handing;  ///< Dealing the tiles out to two threads, storing their pixels, counting their rays.
  Samples looking;  ///< A copy of the colour that is there, as requests for an unfinished image take it.

  void repeat(const RenderContext& context, const std::vector<TileResult>& tiles) {
    std::vector<PixelRect> rects;
    for (const TileResult& tile : tiles) rects.push_back(tile.pixels.rect);
    CpuStopwatch watch;
    const auto next = [&](Samples& samples) {
      samples.add(1e3 * watch.seconds());
      watch = CpuStopwatch();
    };
    Film image(kSide, kSide, context.settings.aovs, rects);
    next(film);
    server::Progress progress;
    {
      server::Scheduler scheduler(2);
      scheduler.submit(tiles.size(), [&](std::size_t i, const server::Scheduler::Turn&) {
        image.store(i, tiles[i].pixels);
        progress.add({tiles[i].rays, tiles[i].tests, static_cast<std::uint64_t>(tiles[i].pixels.rect.area())}, {});
        progress.add_tile();
        return true;
      });
      while (progress.tiles() < tiles.size()) std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
    next(handing);
    const auto there = image.snapshot({});
    next(looking);
  }
};

void measure_tiles(Report& report, const std::string& job, const std::filesystem::path& scene, std::uint32_t samples) {
  const RenderContext context = context_of(scene, samples);
  std::vector<TileResult> tiles;
  const std::vector<double> seconds = tile_seconds(context, tiles);
  const double sum = std::accumulate(seconds.begin(), seconds.end(), 0.0);
  const double longest = *std::ranges::max_element(seconds);

  AroundTiles around;
  for (int i = 0; i < 11; ++i) around.repeat(context, tiles);
  const double beside = 1e-3 * (around.film.median() + around.handing.median());
  const double percent = 100 * beside / (sum + beside);
  std::printf(
      "\n%s: %zu tiles, %.1f ms of processor time, the longest %.2f ms. Beside that %.2f%%: film %s ms, scheduler,\n"
      "storing and counters %s ms. A copy of what is there, which this job needs none of: %s ms.\n",
      job.c_str(), tiles.size(), 1e3 * sum, 1e3 * longest, percent, with_spread(around.film, 2).c_str(),
      with_spread(around.handing, 2).c_str(), with_spread(around.looking, 2).c_str());
  report.at_most("jobs_overhead_percent/" + job, percent, 1);

  std::vector<std::vector<std::string>> rows = {{"cores", "ms", "× one", "efficiency"}};
  auto& figures = report.figures()["tiles"][job];
  figures = {{"tiles", tiles.size()}, {"seconds", sum}, {"longest_seconds", longest}, {"around_percent", percent}};
  for (std::size_t cores = 1; cores <= 64; cores *= 2) {
    const double end = list_schedule(seconds, cores);
    const double speedup = sum / end;
    rows.push_back({std::to_string(cores), fixed(1e3 * end, 1), fixed(speedup, 2),
                    fixed(100 * speedup / static_cast<double>(cores), 1) + "%"});
    figures["simulated_ms"][std::to_string(cores)] = 1e3 * end;
  }
  print_table(rows);
}

}  // namespace

void measure_job_costs(Report& report, const std::string& job, const std::filesystem::path& scene,
                       std::uint32_t samples, const std::filesystem::path& tesserad) {
  measure_steps(report, job, scene, samples, tesserad);
  measure_tiles(report, job, scene, samples);
}

}  // namespace tessera::bench
