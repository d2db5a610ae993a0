#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "core/math/ray.h"

namespace tessera::bench {

/// How Embree is told to build: as it does by default, without losing hits ("robust"), with spatial splits, or small.
enum class EmbreeScenes { normal, robust, high, compact };
/// Those that it is fast with.
inline constexpr std::array kEmbreeScenes = {EmbreeScenes::normal, EmbreeScenes::robust, EmbreeScenes::high};

/// How Embree is told to trace.
struct EmbreeMode {
  EmbreeScenes scenes = EmbreeScenes::normal;
  int width = 1;          ///< Rays in a packet: 1, 8 or 16.
  bool coherent = false;  ///< The hint that a packet's rays are; single rays have none to give.
};
inline std::string name(const EmbreeMode& mode) {
  static constexpr std::array kNames = {"default", "robust", "high", "compact"};
  const std::string scenes = kNames[static_cast<std::size_t>(mode.scenes)];
  return scenes + (mode.width == 1 ? " single" : " " + std::to_string(mode.width)) + (mode.coherent ? " coherent" : "");
}

/// Every mode there is; none when the benchmark was built without Embree.
std::vector<EmbreeMode> embree_modes();

/// "Embree 3.13.5"; empty without Embree.
std::string embree_version();

/// A mesh as Embree keeps it.
class EmbreeScene {
 public:
  virtual ~EmbreeScene() = default;
  /// Everything that Embree holds for it, the mesh's own arrays not counted.
  virtual std::size_t bytes() const = 0;
  virtual bool has_instances() const = 0;
};

/// Hands the mesh over, then builds when told, so that the latter can be timed alone.
class EmbreeBuild {
 public:
  virtual ~EmbreeBuild() = default;
  /// Once.
  virtual std::unique_ptr<EmbreeScene> build() = 0;
};

/// A mesh standing in the world many times over, by rows of 3x4 from the mesh's space to the world's.
using Placements = std::span<const std::array<float, 12>>;

/// Null without Embree. Embree builds with the most threads that any scene or build that is alive was given. The
/// mesh's triangles outlive the scene; its positions are copied.
std::unique_ptr<EmbreeBuild> prepare_embree(const TriangleMesh& mesh, EmbreeScenes scenes, int threads);

/// The same for instances of the mesh, which is built with them.
std::unique_ptr<EmbreeBuild> prepare_embree_instances(const TriangleMesh& mesh, Placements placements,
                                                      EmbreeScenes scenes, int threads);

/// Rays in Embree's own layout, packed in their order, and then its answers.
class EmbreeRays {
 public:
  virtual ~EmbreeRays() = default;
  /// Takes these rays, and forgets all answers.
  virtual void pack(std::span<const Ray> rays) = 0;
  /// With denormals flushed to zero, as Embree's manual asks.
  virtual void trace(const EmbreeScene& scene, bool coherent) = 0;
  /// Each ray's t, infinite for a miss; what hides is at 0. `t` is as long as the rays.
  virtual void answers(std::span<float> t) const = 0;
};
/// Null without Embree.
std::unique_ptr<EmbreeRays> make_embree_rays(int width, bool is_any_hit);

}  // namespace tessera::bench
