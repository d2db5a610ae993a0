#include "server/jobs/job_starter.h"

#include <exception>
#include <utility>
#include <variant>

#include "core/scene/scene.h"
#include "proto/wire/abandoned.h"
#include "server/jobs/job_runner.h"
#include "server/jobs/job_submission.h"

namespace tessera::server {
namespace {

/// How often later jobs may go before one that there is no memory for yet.
constexpr unsigned kMostPassed = 32;

/// What a triangle takes while a structure of the kind is built over it: the growth of the process's peak by a mesh of
/// half a million, rounded up. `automatic` comes to one of the cheap ones.
std::uint64_t bytes_per_triangle(AccelKind kind) {
  switch (kind) {
    case AccelKind::brute:
    case AccelKind::bounds:
      return 30;
    case AccelKind::automatic:
    case AccelKind::bvh:
    case AccelKind::grid:
    case AccelKind::wide:
      return 100;
    case AccelKind::octree:
      return 145;
    case AccelKind::kd:
      return 190;
    case AccelKind::bsp:
      return 440;
  }
  return 0;
}
/// The same of an object in the structure over all.
constexpr std::uint64_t kBytesPerObject = 400;
constexpr std::uint64_t kBytesPerTile = 256;
constexpr std::uint64_t kBytesPerJob = 64 << 10;
/// Few adaptive tiles are smaller.
constexpr std::uint64_t kAdaptiveSide = 16;

}  // namespace

Ledger::Need memory_need(const PreparedJob& job) {
  const Scene& scene = *job.scene.scene;
  const AccelKind kind = job.settings.accel.kind;
  std::uint64_t triangles = 0;
  for (const Shape& shape : scene.shapes)
    if (const auto* mesh = std::get_if<TriangleMesh>(&shape)) triangles += mesh->triangles.size();
  const std::uint64_t pixels = std::uint64_t{job.settings.width} * job.settings.height;
  const std::uint64_t side = job.settings.tile_size == kAdaptiveTiles ? kAdaptiveSide : job.settings.tile_size;
  const std::uint64_t tiles = pixels / (side * side) + 1;
  return {job.scene.hash + ' ' + std::to_string(static_cast<int>(kind)),
          memory_bytes(scene) + triangles * bytes_per_triangle(kind) + scene.objects.size() * kBytesPerObject,
          kBytesPerJob + tiles * kBytesPerTile};
}

void JobStarter::run() {
  thread_ = std::jthread([this](const std::stop_token& stop) { work_on(stop); });
}

void JobStarter::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void JobStarter::add(const std::string& id) {
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back({id});
    may_start_ = true;
  }
  changed_.notify_one();
}

bool JobStarter::has_waiting() const { return waiting() > 0; }

std::size_t JobStarter::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_.size();
}

void JobStarter::look() {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.empty()) return;
    may_start_ = true;
  }
  changed_.notify_one();
}

void JobStarter::work_on(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return may_start_; })) {
    may_start_ = false;
    // Only this thread removes any, so that places stay what they are while others are added.
    for (auto at = waiting_.begin(); at != waiting_.end() && !stop.stop_requested();) {
      lock.unlock();
      const bool has_started = start(at->id, stop);
      lock.lock();
      if (has_started) {
        for (auto earlier = waiting_.begin(); earlier != at; ++earlier) ++earlier->passed;
        at = waiting_.erase(at);
      } else if (at->passed >= kMostPassed) {
        break;
      } else {
        ++at;
      }
    }
  }
}

bool JobStarter::start(const std::string& id, const std::stop_token& stop) {
  const auto view = services_.jobs.find(id);
  if (!view || proto::has_ended(view->state)) return true;
  try {
    const Ledger::Need& need = view->order->need;
    if (need.bytes() > services_.ledger.limit()) {  // An earlier daemon had more.
      services_.jobs.fail(id, "There isn't enough memory for it any more (--memory).");
      return true;
    }
    auto memory = services_.ledger.book(need);
    if (!memory) return false;
    auto admitted = services_.jobs.take_up(id);
    if (!admitted) return true;
    const auto job = prepare_again(services_, *view->order, stop);
    if (!job) {
      services_.jobs.fail(id,
                          job.problem().errors.empty() ? job.problem().detail : job.problem().errors.front().detail);
      return true;
    }
    admitted->memory = std::move(memory);
    services_.runner.start(*admitted, *view->order, job->scene.scene, job->camera);
  } catch (const proto::Abandoned&) {  // The next daemon goes on.
  } catch (const std::exception& error) {
    services_.jobs.fail(id, error.what());
  }
  return true;
}

}  // namespace tessera::server
