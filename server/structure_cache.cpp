#include "server/structure_cache.h"

#include <chrono>
#include <new>
#include <utility>

#include "core/accel/accel_table.h"

namespace tessera::server {
namespace {

std::string key_of(const std::string& scene_hash, const AccelOptions& options) {
  return scene_hash + ' ' + describe(options);
}

std::uint64_t bytes_of(const Structure& structure) {
  return structure.accel->stats().bytes + memory_bytes(*structure.scene);
}

}  // namespace

std::shared_ptr<const Structure> StructureCache::build(const std::shared_ptr<const Scene>& scene,
                                                       const AccelOptions& options) const {
  const auto start = std::chrono::steady_clock::now();
  std::shared_ptr<const Accel> accel = make_(scene, options);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  const double at_once = seconds.count() - accel->stats().mesh_seconds;
  return std::make_shared<const Structure>(Structure{std::move(accel), scene, options, at_once});
}

void StructureCache::get_or_build(const std::string& scene_hash, const std::shared_ptr<const Scene>& scene,
                                  const AccelOptions& options, Done done) {
  const std::string key = key_of(scene_hash, options);
  {
    std::unique_lock lock(mutex_);
    if (auto structure = cache_.find(key)) {
      lock.unlock();
      return done(*structure, true, nullptr);
    }
    const auto [building, first] = waiting_.try_emplace(key);
    if (!first) return building->second.push_back(std::move(done));
  }

  std::shared_ptr<const Structure> structure;
  std::uint64_t bytes = 0;
  std::exception_ptr error;
  try {
    structure = build(scene, options);
    bytes = bytes_of(*structure);
  } catch (...) {
    structure = nullptr;
    error = std::current_exception();
  }

  std::vector<Done> others;
  std::list<std::shared_ptr<const Structure>> evicted;
  {
    const std::lock_guard lock(mutex_);
    others = std::move(waiting_.extract(key).mapped());
    try {
      if (structure) cache_.put(key, structure, bytes, evicted);
    } catch (const std::bad_alloc&) {  // It isn't kept, then.
    }
  }
  done(structure, false, error);
  for (const Done& other : others) other(structure, true, error);
}

void StructureCache::recount(const std::string& scene_hash, const Structure& structure) {
  const std::string key = key_of(scene_hash, structure.options);
  const std::uint64_t bytes = bytes_of(structure);
  std::list<std::shared_ptr<const Structure>> evicted;
  const std::lock_guard lock(mutex_);
  // It may be gone, and another one be in its place.
  if (const auto cached = cache_.find(key); cached && cached->get() == &structure)
    cache_.put(key, *cached, bytes, evicted);
}

}  // namespace tessera::server
