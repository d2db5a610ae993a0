#include "server/structure_cache.h"

#include <chrono>
#include <utility>

#include "core/accel/accel_table.h"

namespace tessera::server {

std::shared_ptr<const Structure> StructureCache::build(const std::shared_ptr<const Scene>& scene,
                                                       const AccelOptions& options) const {
  const auto start = std::chrono::steady_clock::now();
  std::shared_ptr<const Accel> accel = make_(scene, options);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  const AccelStats stats = accel->stats();
  return std::make_shared<const Structure>(Structure{std::move(accel), scene, options, stats, seconds.count()});
}

void StructureCache::get_or_build(const std::string& scene_hash, const std::shared_ptr<const Scene>& scene,
                                  const AccelOptions& options, Done done) {
  const std::string key = scene_hash + ' ' + describe(options);
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
  std::exception_ptr error;
  try {
    structure = build(scene, options);
  } catch (...) {
    error = std::current_exception();
  }

  std::vector<Done> others;
  std::list<std::shared_ptr<const Structure>> evicted;
  {
    const std::lock_guard lock(mutex_);
    others = std::move(waiting_.extract(key).mapped());
    if (structure) cache_.put(key, structure, structure->stats.bytes + memory_bytes(*scene), evicted);
  }
  done(structure, false, error);
  for (const Done& other : others) other(structure, true, error);
}

}  // namespace tessera::server
