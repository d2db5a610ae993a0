#include "server/store/structure_cache.h"

#include <chrono>
#include <new>
#include <utility>

#include "core/accel/accel_table.h"
#include "core/accel/build_stop.h"

namespace tessera::server {
namespace {

std::string key_of(const std::string& scene_hash, const AccelOptions& options) {
  return scene_hash + ' ' + describe(options);
}

std::uint64_t bytes_of(const Structure& structure) {
  return structure.accel->stats().bytes + structure.lights->bytes() + memory_bytes(*structure.scene);
}

}  // namespace

std::shared_ptr<const LightTable> SceneLights::get(const std::shared_ptr<const Scene>& scene) const {
  const std::lock_guard lock(mutex_);
  if (!lights_) {
    lights_ = make_lights(scene);
    bytes_ = lights_->bytes();
  }
  return lights_;
}

std::shared_ptr<const Structure> StructureCache::build(const std::shared_ptr<const Scene>& scene,
                                                       const AccelOptions& options) const {
  const auto start = std::chrono::steady_clock::now();
  std::shared_ptr<const Accel> accel = make_(scene, options);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  const double at_once = seconds.count() - accel->stats().mesh_seconds;
  return std::make_shared<const Structure>(
      Structure{std::move(accel), scene, options, at_once, std::make_shared<const SceneLights>()});
}

StructureCache::Asking StructureCache::get_or_build(const std::string& scene_hash,
                                                    const std::shared_ptr<const Scene>& scene,
                                                    const AccelOptions& options, Done done,
                                                    const std::stop_token& stop) {
  const auto make = [&](const std::stop_token& unwanted) {
    const BuildStop stopped(unwanted);
    auto structure = build(scene, options);
    const std::uint64_t bytes = bytes_of(*structure);
    return Structures::Made{std::move(structure), bytes};
  };
  return structures_.get(
      key_of(scene_hash, options), make,
      [done = std::move(done)](const Structures::Answer& answer, bool shared) {
        done(answer.value.value_or(nullptr), shared, answer.error);
      },
      stop);
}

void StructureCache::recount(const std::string& scene_hash, const std::shared_ptr<const Structure>& structure) {
  structures_.recount(key_of(scene_hash, structure->options), structure, bytes_of(*structure));
}

}  // namespace tessera::server
