#include "server/store/upkeep.h"

#include <chrono>
#include <exception>
#include <filesystem>
#include <string>

#include <spdlog/spdlog.h>

#include "server/store/storage_error.h"

namespace tessera::server {
namespace {

using UpkeepClock = std::chrono::steady_clock;
constexpr std::chrono::seconds kBetweenChecks{5};
constexpr std::chrono::minutes kBetweenSweeps{5};

void let_go(const char* what, const Shelf& shelf, const Shelf::Swept& swept, Owners& owners) {
  for (const std::string& name : swept.names)
    owners.expire("sha256:" + name, [&] { return std::filesystem::exists(shelf.path_of(name)); });
  if (!swept.names.empty()) spdlog::info("{} {} of {} bytes have expired", swept.names.size(), what, swept.bytes);
}

}  // namespace

Upkeep::Upkeep(BlobStore& blobs, SceneStore& scenes, Owners& owners, const Limits& limits)
    : blobs_(blobs), scenes_(scenes), owners_(owners), limits_(limits), thread_([this](const std::stop_token& stop) {
        work_on(stop);
      }) {}

void Upkeep::sweep(BlobStore& blobs, SceneStore& scenes, Owners& owners, const Limits& limits,
                   const std::stop_token& stop) {
  let_go("scenes", scenes.shelf(), scenes.sweep(limits.scenes, stop), owners);  // First, as they need blobs.
  const auto is_needed = [&](const std::string& name) { return scenes.names_blob("sha256:" + name); };
  let_go("blobs", blobs.shelf(), blobs.shelf().sweep(limits.blobs, is_needed, stop), owners);
}

void Upkeep::work_on(const std::stop_token& stop) {
  auto next_sweep = UpkeepClock::now();
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    try {
      limits_.look_after_jobs();
      if (UpkeepClock::now() >= next_sweep || blobs_.shelf().has_outgrown(limits_.blobs) ||
          scenes_.shelf().has_outgrown(limits_.scenes)) {
        next_sweep = UpkeepClock::now() + kBetweenSweeps;
        sweep(blobs_, scenes_, owners_, limits_, stop);
      }
    } catch (const StorageError& error) {
      refuse(error);
    } catch (const std::exception& error) {
      spdlog::error("looking after the data folder: {}", error.what());
    }
    stopped_.wait_for(lock, stop, kBetweenChecks, [] { return false; });
  }
}

}  // namespace tessera::server
