#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "core/accel/accel.h"
#include "core/light/light_table.h"
#include "server/single_flight.h"

namespace tessera::server {

/// A structure that has been made. Some of what it consists of may be made later, when rays come to need it: its
/// `stats()` tell what there is by now.
struct Structure {
  std::shared_ptr<const Accel> accel;
  std::shared_ptr<const Scene> scene;  ///< That it was built over: rendered with it, and with no other.
  AccelOptions options;
  double build_seconds;  ///< Of what was made at once, but for the meshes that `AccelStats` tells of.
};

/// Structures by scene and options, and tables of lights by scene, each made once however many jobs ask for it at the
/// same moment. Who asks while it is being made is called back, so that no thread waits. Safe to call from any number
/// of threads.
class StructureCache {
 public:
  /// What became of it: the structure, or why it couldn't be built. `shared` when another job had it built.
  using Done = std::function<void(std::shared_ptr<const Structure>, bool shared, std::exception_ptr)>;

  /// The lights, or why there are none.
  using LightsDone = std::function<void(std::shared_ptr<const LightTable>, std::exception_ptr)>;

  using Make = std::function<std::unique_ptr<const Accel>(std::shared_ptr<const Scene>, const AccelOptions&)>;

  /// Keeps structures and lights, with the scenes that they hold, up to so many bytes.
  explicit StructureCache(std::uint64_t limit, Make make = make_accel) : make_(std::move(make)), kept_(limit) {}

  /// Calls `done` with the structure: at once if it is there, after building it on this very thread if nobody
  /// else does, and otherwise later on the thread that builds. A failure goes to all who asked, and isn't kept:
  /// the next one tries again. `done` doesn't throw.
  void get_or_build(const std::string& scene_hash, const std::shared_ptr<const Scene>& scene,
                    const AccelOptions& options, Done done);

  /// The same for the scene's lights.
  void get_or_make_lights(const std::string& scene_hash, const std::shared_ptr<const Scene>& scene, LightsDone done);

  /// Counts anew what a structure takes, which may have grown while it was traced: to be called whenever that ends.
  void recount(const std::string& scene_hash, const std::shared_ptr<const Structure>& structure);

 private:
  /// One of both.
  struct Kept {
    std::shared_ptr<const Structure> structure;
    std::shared_ptr<const LightTable> lights;
    bool operator==(const Kept&) const = default;
  };

  std::shared_ptr<const Structure> build(const std::shared_ptr<const Scene>& scene, const AccelOptions& options) const;

  const Make make_;
  SingleFlight<Kept> kept_;
};

}  // namespace tessera::server
