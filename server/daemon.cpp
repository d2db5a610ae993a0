#include "server/daemon.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "core/accel/wide/wide_accel.h"
#include "core/accel/wide/wide_build.h"
#include "core/math/float_environment.h"
#include "server/blob_store.h"
#include "server/data_folder.h"
#include "server/image_cache.h"
#include "server/job_runner.h"
#include "server/job_table.h"
#include "server/listener.h"
#include "server/scene_store.h"
#include "server/scheduler.h"
#include "server/services.h"
#include "server/structure_cache.h"
#include "server/wide_store.h"

namespace tessera::server {
namespace asio = boost::asio;

namespace {

constexpr auto kAwait = asio::as_tuple(asio::use_awaitable);
constexpr unsigned kIoThreads = 2;
constexpr unsigned kWorkers = 2;
/// How long requests, and units of work, that are in progress may go on when the daemon stops.
constexpr std::chrono::milliseconds kPatience{2000};
constexpr std::chrono::milliseconds kLookAgain{5};

std::optional<WideStore> open_wide_store(const Config& config) {
  if (!config.structure_dir) return std::nullopt;
  return std::optional<WideStore>(std::in_place, *config.structure_dir, config.max_structure_dir, config.threads);
}

/// Makes structures whose meshes come from `store`, where there is one, and are built on as many threads as render.
/// Kinds but `wide` have nothing there.
StructureCache::Make make_from(const std::optional<WideStore>& store, unsigned threads) {
  const MakeTree make = [&store, threads](const TriangleMesh& mesh) {
    return store ? store->get(mesh) : MadeTree{build_wide(mesh, {.threads = threads})};
  };
  return [make](std::shared_ptr<const Scene> scene, const AccelOptions& options) -> std::unique_ptr<const Accel> {
    if (options.kind != AccelKind::wide) return make_accel(std::move(scene), options);
    const StrictFloats strict;
    return std::make_unique<const WideAccel>(std::move(scene), options, wide_kernels(), make);
  };
}

/// Everything behind the sockets, wired together.
struct Backend {
  explicit Backend(const Config& config)
      : folder(config.data_dir),
        blobs(folder.blobs(), config.asset_root),
        scenes(folder.scenes(), blobs, config.documents, config.scene_cache),
        wide_store(open_wide_store(config)),
        structures(config.structure_cache, make_from(wide_store, config.threads)),
        jobs({config.max_jobs, config.max_ended_jobs, config.max_film_memory}),
        images(config.image_cache),
        scheduler(config.threads),
        runner(scheduler, structures, jobs),
        services{config, blobs, scenes, jobs, images, runner} {}

  DataFolder folder;
  BlobStore blobs;
  SceneStore scenes;
  std::optional<WideStore> wide_store;
  StructureCache structures;
  JobTable jobs;
  ImageCache images;
  Scheduler scheduler;
  JobRunner runner;
  Services services;
};

void start_log(const std::string& level) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("tesserad"));
  spdlog::set_level(spdlog::level::from_str(level));
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %l %v", spdlog::pattern_time_type::utc);
}

/// Waits for a signal; then refuses what is new, ends jobs, lets requests in progress finish, and stops `io`.
asio::awaitable<void> stop_on_signal(asio::io_context& io, asio::signal_set& signals, asio::ip::tcp::acceptor& acceptor,
                                     Backend& backend, const Connections& connections) {
  const auto [error, signal] = co_await signals.async_wait(kAwait);
  spdlog::info("signal {}: stopping", signal);
  backend.services.shutting_down = true;
  backend.jobs.shut_down();
  asio::post(acceptor.get_executor(), [&acceptor] { acceptor.close(); });
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (connections.requests_active > 0 && std::chrono::steady_clock::now() < deadline) {
    asio::steady_timer timer(io, kLookAgain);
    co_await timer.async_wait(kAwait);
  }
  io.stop();
}

}  // namespace

void run_daemon(const Config& config) {
  start_log(config.log_level);
  Backend backend(config);
  asio::thread_pool workers(kWorkers);
  Connections connections{backend.services, workers};
  asio::io_context io;
  std::signal(SIGPIPE, SIG_IGN);  // A log whose reader is gone is no reason to stop.
  asio::signal_set signals(io, SIGTERM, SIGINT);
  auto acceptor = listen_on(io, config.host, config.port);
  asio::co_spawn(acceptor.get_executor(), accept_all(io, acceptor, connections), asio::detached);
  asio::co_spawn(io, stop_on_signal(io, signals, acceptor, backend, connections), asio::detached);
  std::cout << "listening on " << url_of(acceptor) << std::endl;
  spdlog::info("{} threads render; data in {}", config.threads, config.data_dir.string());

  {
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < kIoThreads; ++i) threads.emplace_back([&io] { io.run(); });
  }
  const bool idle = backend.scheduler.shut_down(kPatience) && connections.requests_active == 0;
  spdlog::info("stopped");
  if (!idle) {  // A build or a parse that can't be interrupted: nothing of it is worth waiting for.
    spdlog::default_logger()->flush();
    std::_Exit(0);
  }
  workers.join();
}

}  // namespace tessera::server
