#include "tests/benchmarks/support/job_overhead.h"

#include <stdexcept>
#include <thread>

#include <nlohmann/json.hpp>

#include "client/client.h"
#include "proto/parse.h"
#include "tests/benchmarks/support/daemon_process.h"
#include "tests/benchmarks/support/render_image.h"
#include "tests/support/random.h"

namespace tessera::bench {
namespace {

constexpr int kJobs = 101;
constexpr std::uint32_t kSide = 64;

/// A hundred spheres over a floor, a third of them mirrors.
nlohmann::json scene_document() {
  Random random(1);
  nlohmann::json objects = {
      {{"type", "quad"}, {"corners", {{-9, -1, 9}, {9, -1, 9}, {9, -1, -9}, {-9, -1, -9}}}, {"material", "matt"}}};
  for (int i = 0; i < 100; ++i)
    objects.push_back({{"type", "sphere"},
                       {"center", {random.uniform(-4, 4), random.uniform(-1, 2), random.uniform(-4, 4)}},
                       {"radius", random.uniform(0.1, 0.6)},
                       {"material", i % 3 == 0 ? "mirror" : "matt"}});
  return {{"camera", {{"type", "perspective"}, {"from", {0, 3, 9}}, {"at", {0, 0, 0}}, {"fov", 45}}},
          {"materials",
           {{"matt", {{"type", "diffuse"}, {"color", {0.7, 0.6, 0.5}}}},
            {"mirror", {{"type", "mirror"}, {"color", {0.9, 0.9, 0.9}}}}}},
          {"lights", {{{"type", "point"}, {"position", {5, 8, 5}}, {"intensity", {300, 300, 300}}}}},
          {"objects", objects}};
}

/// The scene names no files.
class NoFiles final : public proto::FileSource {
 public:
  proto::Result<proto::SourceFile> blob(const proto::ContentHash&, const std::stop_token&) const override {
    throw std::logic_error("a file");
  }
  proto::Result<proto::SourceFile> asset(std::string_view, const std::stop_token&) const override {
    throw std::logic_error("a file");
  }
  const proto::AssetReader& reader() const override { return proto::direct_reader(); }
};

proto::JobStatus wait_for(const client::Client& client, proto::JobStatus status) {
  while (!proto::has_ended(status.state)) {
    std::this_thread::sleep_for(std::chrono::microseconds(200));
    status = client.status(status.id);
  }
  if (status.state != proto::JobState::completed) throw std::runtime_error("the job failed: " + status.error);
  return status;
}

}  // namespace

/// Makes the scene known to the daemon; its hash.
std::string post_scene(const client::ServerAddress& daemon, const std::string& document) {
  const auto answer = client::exchange(daemon, {"POST", "/v1/scenes", "application/json", document});
  if (answer.status != 201) throw std::runtime_error("the daemon refuses the scene: " + answer.body);
  return nlohmann::json::parse(answer.body)["scene"];
}

JobOverhead measure_job_overhead(const std::filesystem::path& tesserad) {
  const std::string document = scene_document().dump();
  const auto parsed = proto::parse_scene(document, NoFiles(), {});
  if (!parsed) throw std::runtime_error("the scene is refused: " + parsed.problem().detail);
  Settings settings;
  settings.width = settings.height = kSide;
  const RenderContext context = prepare(parsed->scene, *parsed->scene->camera, settings);
  const unsigned threads = std::max(1U, std::thread::hardware_concurrency());

  const DaemonProcess daemon(tesserad);
  const client::Client client(daemon.address());
  const nlohmann::json job = {{"scene", post_scene(daemon.address(), document)},
                              {"image", {{"width", kSide}, {"height", kSide}}}};
  wait_for(client, client.submit(job));  // builds the structure

  JobOverhead out;
  for (int i = 0; i < kJobs; ++i) {
    const double tracing = 1e3 * render(context, threads).seconds;
    const Stopwatch watch;
    const proto::JobStatus done = wait_for(client, client.submit(job));
    const double completed = 1e3 * watch.seconds();
    if (client.fetch(done.id, {}).empty()) throw std::runtime_error("an empty image");
    const double fetched = 1e3 * watch.seconds();
    out.tracing.add(tracing);
    out.completed.add(completed - tracing);
    out.fetched.add(fetched - tracing);
  }
  return out;
}

}  // namespace tessera::bench
