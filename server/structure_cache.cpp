#include "server/structure_cache.h"

#include <chrono>
#include <new>
#include <utility>

#include "core/accel/accel_table.h"
#include "core/math/float_environment.h"

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
  const auto make = [&](const std::stop_token&) {
    auto structure = build(scene, options);
    const std::uint64_t bytes = bytes_of(*structure);
    return SingleFlight<Kept>::Made{{std::move(structure), nullptr}, bytes};
  };
  kept_.get(key_of(scene_hash, options), make,
            [done = std::move(done)](const SingleFlight<Kept>::Answer& answer, bool shared) {
              done(answer.value.value_or(Kept{}).structure, shared, answer.error);
            });
}

void StructureCache::get_or_make_lights(const std::string& scene_hash, const std::shared_ptr<const Scene>& scene,
                                        LightsDone done) {
  const auto make = [&](const std::stop_token&) {
    const StrictFloats strict;
    auto lights = std::make_shared<const LightTable>(scene);
    const std::uint64_t bytes = lights->bytes() + memory_bytes(*scene);
    return SingleFlight<Kept>::Made{{nullptr, std::move(lights)}, bytes};
  };
  kept_.get(scene_hash + " lights", make, [done = std::move(done)](const SingleFlight<Kept>::Answer& answer, bool) {
    done(answer.value.value_or(Kept{}).lights, answer.error);
  });
}

void StructureCache::recount(const std::string& scene_hash, const std::shared_ptr<const Structure>& structure) {
  kept_.recount(key_of(scene_hash, structure->options), {structure, nullptr}, bytes_of(*structure));
}

}  // namespace tessera::server
