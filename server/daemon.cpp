#include "server/daemon.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <ctime>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include "core/accel/wide/wide_accel.h"
#include "core/accel/wide/wide_build.h"
#include "core/io/read_texture.h"
#include "core/math/float_environment.h"
#include "server/http/http_syntax.h"
#include "server/http/key_ring.h"
#include "server/http/listener.h"
#include "server/http/tls_context.h"
#include "server/isolation/confinement.h"
#include "server/isolation/isolated_reader.h"
#include "server/isolation/isolation.h"
#include "server/isolation/read_requests.h"
#include "server/jobs/job_runner.h"
#include "server/jobs/job_starter.h"
#include "server/jobs/job_submission.h"
#include "server/jobs/job_table.h"
#include "server/jobs/known_jobs.h"
#include "server/jobs/ledger.h"
#include "server/jobs/quotas.h"
#include "server/log.h"
#include "server/memory_reserve.h"
#include "server/service_manager.h"
#include "server/services.h"
#include "server/store/blob_store.h"
#include "server/store/data_folder.h"
#include "server/store/image_cache.h"
#include "server/store/image_store.h"
#include "server/store/journal.h"
#include "server/store/owners.h"
#include "server/store/scene_store.h"
#include "server/store/structure_cache.h"
#include "server/store/upkeep.h"
#include "server/store/wide_store.h"
#include "server/watchdog.h"
#include "server/webhooks/webhook_deliveries.h"
#include "server/webhooks/webhook_sender.h"
#include "server/work/scheduler.h"

namespace tessera::server {
namespace {

constexpr unsigned kIoThreads = 2;
constexpr unsigned kQuickThreads = 4;  // More than cores: some wait for the disk.
constexpr unsigned kSlowThreads = 2;
constexpr unsigned kWriters = 8;  // They wait for the disk, which syncs for several at once.
/// How long requests, and units of work, that are in progress may go on when the daemon stops.
constexpr std::chrono::milliseconds kPatience{2000};
constexpr std::chrono::milliseconds kLookAgain{5};

std::optional<WideStore> open_wide_store(const Config& config, const DataFolder& folder) {
  if (!config.structure_dir) return std::nullopt;
  return std::optional<WideStore>(std::in_place, *config.structure_dir, folder.set_aside(), config.max_structure_dir,
                                  config.threads);
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
    return make_wide(std::move(scene), options, wide_kernels(), make);
  };
}

std::optional<TlsContext> tls_context(const Config& config) {
  if (!config.tls_key) return std::nullopt;
  return std::optional<TlsContext>(std::in_place, *config.tls_certificate, *config.tls_key);
}

/// Receivers have so long to answer.
constexpr std::chrono::seconds kMostForWebhook{15};

/// Where webhooks may go anywhere.
std::unique_ptr<WebhookDeliveries> webhook_deliveries(const Config& config, JobTable& jobs) {
  if (!config.webhook_secret) return nullptr;
  const auto sender = std::make_shared<const WebhookSender>(config.webhooks.allow_private, kMostForWebhook);
  return std::make_unique<WebhookDeliveries>(jobs, config.webhooks, *config.webhook_secret,
                                             [sender](const auto& target, const auto& request, const auto& stop) {
                                               return sender->send(target, request, stop);
                                             });
}

JobTable::Limits job_limits(const Config& config) {
  return {config.max_jobs, config.max_ended_jobs, config.max_film_memory};
}

Upkeep::Limits retention(const Config& config, JobTable& jobs) {
  const JobTable::Retention of_jobs{std::chrono::seconds(config.max_job_age),
                                    std::chrono::seconds(config.max_image_age), config.max_image_bytes,
                                    std::chrono::seconds(config.max_job_seconds)};
  return {{config.max_blob_bytes, std::chrono::seconds(config.max_blob_age)},
          {config.max_scene_bytes, std::chrono::seconds(config.max_scene_age)},
          [&jobs, of_jobs] { jobs.look_after(of_jobs); }};
}

/// Everything behind the sockets, wired together.
struct Backend {
  Backend(const Config& config, const Isolation& isolation)
      : reader(isolation, config.max_parse_seconds),
        folder(config.data_dir),
        keys(config.data_dir, config.require_keys),
        tls(tls_context(config)),
        owners(folder.owners()),
        blobs(folder.blobs(), folder.set_aside(), config.asset_root, reader),
        scenes(folder.scenes(), folder.set_aside(), blobs, config.documents, config.scene_cache),
        wide_store(open_wide_store(config, folder)),
        structures(config.structure_cache, make_from(wide_store, config.threads)),
        journal(folder.journal(), folder.has_traces_of_jobs() ? Journal::Missing::is_lost : Journal::Missing::is_new),
        films(folder.images(), folder.set_aside(), journal),
        jobs(job_limits(config), &journal, [this](const std::string& id) { films.remove(id); }),
        unfinished(restore_jobs(journal, films, scenes, jobs)),
        ledger(config.work_memory,
               {{[this] { return structures.usage().bytes; }, [this](std::uint64_t most) { structures.shrink(most); }},
                {[this] { return scenes.scenes_usage().bytes; }, [this](std::uint64_t most) { scenes.shrink(most); }}}),
        images(config.image_cache),
        scheduler(config.threads),
        writers(kWriters),
        runner(scheduler, structures, jobs, std::chrono::steady_clock::now, JobFiles{films, folder.tiles(), writers}),
        services{config, keys,   owners,  quotas,    blobs,      scenes,  jobs,  known_jobs, images,
                 runner, ledger, starter, scheduler, structures, journal, films, isolation},
        webhooks(webhook_deliveries(config, jobs)),
        upkeep(blobs, scenes, owners, retention(config, jobs)) {
    remove_what_nobody_needs();
    ledger.when_freed([this] { starter.look(); });
    for (const std::string& id : unfinished) starter.add(id);
  }

  /// Of jobs that aren't there any more, or have ended.
  void remove_what_nobody_needs() {
    const auto state_of = [this](const std::filesystem::path& path) -> std::optional<proto::JobState> {
      const auto job = jobs.find(path.stem());
      return job ? std::optional(job->state) : std::nullopt;
    };
    std::error_code error;  // Of a folder that isn't there.
    for (const auto& entry : std::filesystem::directory_iterator(folder.images()))
      if (state_of(entry.path()) != proto::JobState::completed) std::filesystem::remove(entry.path());
    for (const std::string& job : journal.images())
      if (state_of(job) != proto::JobState::completed) journal.remove_image(job);
    for (const auto& entry : std::filesystem::directory_iterator(folder.tiles(), error))
      if (state_of(entry.path()) != proto::JobState::queued) std::filesystem::remove_all(entry.path());
  }

  IsolatedReader reader;
  DataFolder folder;
  KeyRing keys;
  std::optional<TlsContext> tls;
  Owners owners;
  Quotas quotas;
  BlobStore blobs;
  SceneStore scenes;
  std::optional<WideStore> wide_store;
  StructureCache structures;
  Journal journal;
  ImageStore films;
  JobTable jobs;
  const std::vector<std::string> unfinished;  ///< Jobs of earlier daemons that hadn't ended.
  Ledger ledger;
  JobStarter starter{services};  ///< Outlives all work, whose end it is told of.
  KnownJobs known_jobs;
  ImageCache images;
  Scheduler scheduler;
  Scheduler writers;  ///< Of images.
  JobRunner runner;
  Services services;
  const std::unique_ptr<WebhookDeliveries> webhooks;  ///< Null where there are none.
  Upkeep upkeep;                                      ///< Last, when jobs hold the files that they need.
};

/// The threads that serve connections, each with a loop of its own.
class IoThreads {
 public:
  ~IoThreads() { stop(); }

  /// Throws std::system_error when there can't be so many.
  void start(const FileDescriptor& listening, Connections& connections, Watchdog& watchdog) {
    for (EventLoop& loop : loops_) accept_all(loop, listening, connections).handle.resume();
    for (std::size_t i = 0; watchdog.is_wanted() && i < loops_.size(); ++i)
      watchdog.watch(loops_[i], i).handle.resume();
    for (EventLoop& loop : loops_) threads_.emplace_back([&loop] { loop.run(); });
    for (std::jthread& thread : threads_) ::pthread_setname_np(thread.native_handle(), "io");  // As top -H tells them.
  }

  void stop() {
    for (EventLoop& loop : loops_) loop.stop();
    threads_.clear();
  }

 private:
  std::array<EventLoop, kIoThreads> loops_;
  std::vector<std::jthread> threads_;
};

/// Signals that are waited for, and that no thread is interrupted by.
sigset_t hold_signals() {
  std::signal(SIGPIPE, SIG_IGN);  // A log whose reader is gone is no reason to stop,
  std::signal(SIGXFSZ, SIG_IGN);  // and neither is a file that may not grow: writing says so.
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    std::signal(signal, SIG_DFL);  // What is ignored, as behind nohup, can't be waited for.
    sigaddset(&signals, signal);
  }
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

LogSettings log_settings(const Config& config) {
  return {config.log_level, config.log_format == "json" ? LogFormat::json : LogFormat::text, config.access_log};
}

/// As many file descriptors as the system lets this process have; how many those are.
rlim_t raise_descriptor_limit() {
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) != 0) return std::numeric_limits<rlim_t>::max();
  const rlim_t given = std::exchange(files.rlim_cur, files.rlim_max);
  return ::setrlimit(RLIMIT_NOFILE, &files) == 0 ? files.rlim_max : given;
}

void read_certificate_again(TlsContext& tls) {
  try {
    tls.reload();
  } catch (const std::exception& error) {
    spdlog::error("SIGHUP: the certificate stays as it is: {}", error.what());
  }
}

void read_keys_again(KeyRing& keys) {
  try {
    spdlog::info("SIGHUP: there are {} keys", keys.reload());
  } catch (const std::exception& error) {
    spdlog::error("SIGHUP: the keys stay as they are: {}", error.what());
  }
}

void read_webhook_secret_again(WebhookDeliveries& webhooks) {
  try {
    webhooks.reload();
  } catch (const std::exception& error) {
    spdlog::error("SIGHUP: the webhooks' secret stays as it is: {}", error.what());
  }
}

/// As many connections as the settings allow and there are file descriptors for, half of them being for files.
std::uint32_t most_connections(const Config& config, rlim_t descriptors) {
  const rlim_t most = std::max<rlim_t>(descriptors / 2, 1);
  if (config.max_connections <= most) return config.max_connections;
  spdlog::warn(
      "of --max-connections {} only {} are taken: the system gives {} file descriptors (LimitNOFILE, ulimit -n)",
      config.max_connections, most, descriptors);
  return static_cast<std::uint32_t>(most);
}

/// The daemon at work, as signals change it.
class Operation {
 public:
  Operation(const sigset_t& signals, const ReadConfig& read_again, Log& log, const ServiceManager& manager)
      : signals_(signals), read_again_(read_again), log_(log), manager_(manager) {}

  /// Puts in force what may change while requests and jobs are under way. Everything else takes a restart.
  void apply(const Config& config, Backend& backend) {
    log_.set(log_settings(config));
    backend.jobs.set_limits(job_limits(config));
    backend.services.most_connections = most_connections(config, descriptors_);
    backend.services.least_free_disk = config.min_free_disk;
    drain_ = std::chrono::seconds(config.drain_seconds);
  }

  /// Works until a signal says that it is enough.
  void wait_for_end(Backend& backend) {
    for (int signal = 0;;) {
      if (sigwait(&signals_, &signal) != 0) continue;
      if (signal != SIGHUP) return spdlog::info("signal {}: stopping", signal);
      reload(backend);
    }
  }

  /// Takes no more jobs, and waits until those that there are have ended, until it takes too long, or for another
  /// signal to stop.
  void drain(Backend& backend) {
    backend.services.draining = true;
    backend.jobs.close();
    const auto deadline = std::chrono::steady_clock::now() + drain_;
    const auto left = [&] { return backend.jobs.usage().unfinished; };
    const auto is_idle = [&] { return left() == 0 && (!backend.webhooks || backend.webhooks->pressing() == 0); };
    if (left() > 0) spdlog::info("{} jobs go on, for {} s at most", left(), drain_.count());
    // Webhooks are told of an end a moment after it.
    const int looks = backend.webhooks ? 2 : 1;
    for (int idle = is_idle() ? 1 : 0; idle < looks && std::chrono::steady_clock::now() < deadline;
         idle = is_idle() ? idle + 1 : 0) {
      const timespec pause{0, std::chrono::nanoseconds(kLookAgain).count()};
      const int signal = ::sigtimedwait(&signals_, nullptr, &pause);
      if (signal == SIGHUP) reload(backend);
      if (signal == SIGTERM || signal == SIGINT) break;
    }
    if (left() > 0) spdlog::warn("{} jobs are ended before they are done", left());
  }

 private:
  void reload(Backend& backend) {
    manager_.tell_reloading();
    try {
      read_keys_again(backend.keys);
      if (backend.tls) read_certificate_again(*backend.tls);
      if (backend.webhooks) read_webhook_secret_again(*backend.webhooks);
      std::ostringstream said;
      const auto read = read_again_(said, said);
      if (const Config* config = std::get_if<Config>(&read)) {
        apply(*config, backend);
        spdlog::info(
            "SIGHUP: the log's level is {}, the access log {}; at most {} jobs, {} ended ones, {} bytes of images, {} "
            "connections; other settings take a restart",
            config->log_level, config->access_log ? "on" : "off", config->max_jobs, config->max_ended_jobs,
            config->max_film_memory, backend.services.most_connections.load());
      } else {
        std::string why = said.str();
        std::ranges::replace(why, '\n', ' ');
        spdlog::error("SIGHUP: the settings stay as they are: {}", why);
      }
    } catch (const std::exception& error) {
      spdlog::error("SIGHUP: {}", error.what());
    }
    manager_.tell("READY=1");
  }

  const sigset_t signals_;
  const ReadConfig& read_again_;
  Log& log_;
  const ServiceManager& manager_;
  const rlim_t descriptors_ = raise_descriptor_limit();
  std::chrono::seconds drain_{0};
};

/// Throws where strangers could come in by mistake.
void expect_keys_beyond_loopback(const Config& config, const KeyRing& keys, const FileDescriptor& listening) {
  const std::string address = canonical_host(address_of(listening.value()));
  if (!keys.is_open() || address.starts_with("127.") || address == "::1") return;
  if (config.insecure_no_keys)
    return spdlog::warn("there are no keys: whoever reaches {} may do everything (--insecure-no-keys)", config.host);
  throw std::runtime_error("others than this machine can reach --host " + config.host +
                           ", and there are no keys. Make one: tessera keys add --data-dir '" +
                           config.data_dir.string() +
                           "' --owner NAME. Or listen on 127.0.0.1. Or, where something else keeps strangers out, say "
                           "--insecure-no-keys.");
}

void serve_until_signal(const Config& config, const ReadConfig& read_again, const sigset_t& signals, Log& log,
                        const Isolation& isolation) {
  MemoryReserve::refill();
  const ServiceManager manager;
  Operation operation(signals, read_again, log, manager);
  if (!can_filter_system_calls())
    spdlog::warn("the system doesn't filter system calls (seccomp): processes that read files are less confined");
  Backend backend(config, isolation);
  operation.apply(config, backend);
  Lane quick(kQuickThreads), slow(kSlowThreads);
  Connections connections{backend.services, quick, slow, backend.tls ? &*backend.tls : nullptr};
  backend.services.connections = &connections;
  const FileDescriptor listening = listen_on(config.host, config.port);
  expect_keys_beyond_loopback(config, backend.keys, listening);
  Watchdog watchdog(manager, kIoThreads);
  IoThreads io;
  io.start(listening, connections, watchdog);
  std::cout << "listening on " << url_of(listening, backend.tls.has_value()) << std::endl;
  spdlog::info("{} threads render; data in {}", config.threads, config.data_dir.string());
  manager.tell("READY=1");

  if (!backend.unfinished.empty())
    spdlog::info("{} jobs go on that an earlier daemon was asked for", backend.unfinished.size());
  backend.starter.run();

  operation.wait_for_end(backend);
  manager.tell("STOPPING=1");
  operation.drain(backend);
  backend.services.shutting_down = true;
  ::shutdown(listening.value(), SHUT_RD);  // Nobody connects any more.
  backend.jobs.shut_down();
  backend.starter.stop();
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (connections.requests_active > 0 && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(kLookAgain);
  io.stop();
  const bool idle = backend.scheduler.shut_down(kPatience) && backend.writers.shut_down(kPatience) &&
                    (!backend.webhooks || backend.webhooks->shut_down(kPatience)) && connections.requests_active == 0;
  spdlog::info("stopped");
  if (!idle) {  // A build or a parse that can't be interrupted: nothing of it is worth waiting for.
    log.close();
    std::_Exit(0);
  }
  quick.close();  // While the loops are there that they post to.
  slow.close();
}

}  // namespace

int run_daemon(const Config& config, const ReadConfig& read_again) {
  const sigset_t signals = hold_signals();
  const Isolation isolation(read_in_worker, load_image_library);  // While there is no other thread.
  Log log(log_settings(config));
  try {
    serve_until_signal(config, read_again, signals, log, isolation);
    return 0;
  } catch (const std::exception& error) {
    spdlog::critical("{}", error.what());
    return 1;
  }
}

}  // namespace tessera::server
