#include "tests/benchmarks/support/light_renderers.h"

#include <chrono>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "tests/benchmarks/support/exr_file.h"
#include "tests/benchmarks/support/job_peer_process.h"

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// "rendered in 3.92909", run by run.
std::vector<double> seconds_in(const fs::path& log) {
  const std::string words = "rendered in ";
  std::vector<double> seconds;
  std::ifstream file(log);
  for (std::string line; std::getline(file, line);)
    if (line.starts_with(words)) seconds.push_back(std::stod(line.substr(words.size())));
  return seconds;
}

}  // namespace

Tessera::Tessera(const fs::path& tesserad, fs::path folder, unsigned threads)
    : folder_(std::move(folder)),
      daemon_(tesserad, {"--threads", std::to_string(threads), "--asset-root", folder_.string()}),
      client_(daemon_.address()) {}

std::string Tessera::known(const LightScene& scene) {
  std::string& hash = hashes_[scene.name];
  if (hash.empty()) {
    const auto reply =
        client::exchange(daemon_.address(), {"POST", "/v1/scenes", "application/json", scene.document.dump()});
    if (reply.status != 200 && reply.status != 201) throw std::runtime_error(scene.name + " is refused: " + reply.body);
    hash = json::parse(reply.body).at("scene");
  }
  return hash;
}

Rendered Tessera::render(const LightScene& scene, json settings, json* stats, proto::JobStatus* job_status) {
  settings["integrator"] = "path";
  settings["max_depth"] = scene.max_depth;
  const json job = {{"scene", known(scene)},
                    {"camera", scene.document.at("camera")},
                    {"image", {{"width", kLightSide}, {"height", kLightSide}}},
                    {"settings", std::move(settings)}};
  const double before = daemon_.cpu_seconds();
  proto::JobStatus status = client_.submit(job);
  while (!proto::has_ended(status.state)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // seldom: answers take time from rendering
    status = client_.status(status.id);
  }
  const double seconds = daemon_.cpu_seconds() - before;
  if (status.state != proto::JobState::completed) throw std::runtime_error(scene.name + " failed: " + status.error);
  if (stats != nullptr) *stats = client_.stats(status.id);
  if (job_status != nullptr) *job_status = status;
  const fs::path file = folder_ / "ours.exr";
  std::ofstream(file, std::ios::binary) << client_.fetch(status.id, {.format = "exr"});
  client_.remove(status.id);
  return {read_exr(file), seconds};
}

std::vector<Rendered> render_with_cycles(const LightScene& scene, const fs::path& folder, unsigned threads,
                                         const std::vector<CyclesRun>& runs) {
  const fs::path document = folder / (scene.name + ".json"), order_file = folder / (scene.name + "-cycles.json");
  const fs::path log = folder / (scene.name + "-cycles.log");
  json order = {{"scene", document.string()},   {"width", kLightSide}, {"height", kLightSide},
                {"max_depth", scene.max_depth}, {"threads", threads},  {"runs", json::array()}};
  const auto image = [&](std::size_t i) { return folder / (scene.name + "-cycles-" + std::to_string(i) + ".exr"); };
  for (std::size_t i = 0; i < runs.size(); ++i)
    order["runs"].push_back({{"samples", runs[i].samples}, {"seed", runs[i].seed}, {"image", image(i).string()}});
  std::ofstream(document) << scene.document.dump();
  std::ofstream(order_file) << order.dump();
  seconds_to_run({"blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python",
                  TESSERA_SOURCE_DIR "/tests/benchmarks/support/cycles_render.py", "--", order_file.string()},
                 log);
  const std::vector<double> seconds = seconds_in(log);
  if (seconds.size() != runs.size()) throw std::runtime_error("Cycles told no render times in " + log.string());
  std::vector<Rendered> rendered;
  for (std::size_t i = 0; i < runs.size(); ++i) rendered.push_back({read_exr(image(i)), seconds[i]});
  return rendered;
}

}  // namespace tessera::bench
