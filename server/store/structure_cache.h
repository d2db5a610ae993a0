#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <utility>

#include "core/accel/accel.h"
#include "core/light/light_table.h"
#include "server/store/single_flight.h"

namespace tessera::server {

/// The lights of a scene, which are made when the first job needs them. Safe to call from any number of threads.
class SceneLights {
 public:
  /// Who asks first makes them; who asks meanwhile waits. If making them throws, so does this, and the next one tries
  /// again.
  std::shared_ptr<const LightTable> get(const std::shared_ptr<const Scene>& scene) const;

  std::uint64_t bytes() const { return bytes_; }

 private:
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const LightTable> lights_;
  mutable std::atomic<std::uint64_t> bytes_ = 0;
};

/// A structure that has been made. Some of what it consists of may be made later, when rays come to need it: its
/// `stats()` tell what there is by now.
struct Structure {
  std::shared_ptr<const Accel> accel;
  std::shared_ptr<const Scene> scene;  ///< That it was built over: rendered with it, and with no other.
  AccelOptions options;
  double build_seconds;  ///< Of what was made at once, but for the meshes that `AccelStats` tells of.
  std::shared_ptr<const SceneLights> lights;
};

/// Structures by scene and options, each built once however many jobs ask for it at the same moment. Who asks while
/// it is being built is called back, so that no thread waits. Safe to call from any number of threads.
class StructureCache {
 public:
  /// What became of it: the structure, or why it couldn't be built. `shared` when another job had it built.
  using Done = std::function<void(std::shared_ptr<const Structure>, bool shared, std::exception_ptr)>;

  using Make = std::function<std::unique_ptr<const Accel>(std::shared_ptr<const Scene>, const AccelOptions&)>;

  /// Keeps structures, with the scenes that they hold, up to so many bytes.
  explicit StructureCache(std::uint64_t limit, Make make = make_accel) : make_(std::move(make)), structures_(limit) {}

  using Asking = std::shared_ptr<const void>;

  /// Calls `done` with the structure: at once if it is there, after building it on this very thread if nobody
  /// else does, and otherwise later on the thread that builds. A failure goes to all who asked, and isn't kept:
  /// the next one tries again. `done` doesn't throw. Building ends soon when all who asked have requested their stops;
  /// a stop counts as long as there is what this returns.
  Asking get_or_build(const std::string& scene_hash, const std::shared_ptr<const Scene>& scene,
                      const AccelOptions& options, Done done, const std::stop_token& stop = {});

  /// Counts anew what a structure takes, which may have grown while it was traced: to be called whenever that ends.
  void recount(const std::string& scene_hash, const std::shared_ptr<const Structure>& structure);

  CacheUsage usage() const { return structures_.usage(); }
  /// Keeps so many bytes at most for now.
  void shrink(std::uint64_t most) { structures_.shrink(most); }

 private:
  using Structures = SingleFlight<std::shared_ptr<const Structure>>;

  std::shared_ptr<const Structure> build(const std::shared_ptr<const Scene>& scene, const AccelOptions& options) const;

  const Make make_;
  Structures structures_;
};

}  // namespace tessera::server
