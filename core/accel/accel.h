#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "core/accel/object_marks.h"
#include "core/accel/test_counts.h"
#include "core/math/ray_fan.h"
#include "core/scene/accel_options.h"
#include "core/scene/scene.h"

namespace tessera {

/// What a ray met first. Hits are ordered by (t, object, primitive): at equal t the smaller identity wins.
struct Hit {
  float t = kInfinity;
  std::uint32_t object = 0;
  std::uint32_t primitive = 0;  ///< Within the object's shape.

  auto operator<=>(const Hit&) const = default;
};

/// What a structure is made of, by now.
struct AccelStats {
  std::uint64_t bytes = 0;
  std::uint64_t nodes = 0;
  std::uint64_t leaves = 0;
  std::uint32_t depth = 0;

  // Of a structure that leaves each mesh alone until a ray comes to it; zeros for others.
  std::uint64_t meshes = 0;
  std::uint64_t meshes_ready = 0;   ///< Those that a ray has come to,
  std::uint64_t meshes_loaded = 0;  ///< and of them those whose part was on disk.
  double mesh_seconds = 0;          ///< What making them ready took, all together.
};

/// What tracing leaves behind beside its answer. What is null isn't recorded, and costs nothing.
struct TraceLog {
  ObjectMarks* tested = nullptr;  ///< Objects that are tested, beyond their bounds, are marked.
  TestCounts* counts = nullptr;
};

/// The only objects that rays can hit, ascending; all of the scene's where there is no list.
using Candidates = std::optional<std::span<const std::uint32_t>>;

/// The seam: every structure answers the same two questions with the same bits (laws L1 and L2 of the design).
/// Immutable once made; all calls are safe from any number of threads, each with counts of its own. A ray that isn't
/// `is_traceable` misses.
class Accel {
 public:
  virtual ~Accel() = default;

  /// The smallest hit in the ray's open interval.
  virtual std::optional<Hit> closest(const Ray& ray, TraceLog log = {}) const = 0;

  /// Whether anything at all lies in the ray's open interval.
  virtual bool occluded(const Ray& ray, TraceLog log = {}) const = 0;

  /// Like `closest`, for a ray that can hit no objects but these (ascending indices): one of the first level, that
  /// knows what projects into its tile. Whether it may hit others isn't asked.
  virtual std::optional<Hit> closest_among(const Ray& ray, std::span<const std::uint32_t> objects,
                                           TraceLog log = {}) const = 0;

  /// The next object that the ray meets at the very t of `hit`, in the order of hits: of those with a greater number
  /// the first. Surfaces that coincide are told apart by that; within an object the first is all there is.
  virtual std::optional<Hit> coincident(const Ray& ray, const Hit& hit, TraceLog log = {}) const = 0;

  // Many rays at once: the answers are those of `closest`, `closest_among` and `occluded`, ray by ray; hits[i].t is
  // infinite for a miss, hidden[i] is 1 or 0. Spans are of one length. What a structure gains from knowing the rays
  // together differs; by default it is nothing.

  /// Any rays; neighbours in the span had better be neighbours in space.
  virtual void closest(std::span<const Ray> rays, std::span<Hit> hits, TraceLog log = {}, Candidates among = {}) const;
  virtual void occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log = {}) const;

  /// Rays that all leave one point. Those that are neighbours by sixteens had better be so in space.
  virtual void closest_fan(const RayFan& fan, std::span<Hit> hits, TraceLog log = {}, Candidates among = {}) const;

  /// Rays that all lead to one point, as far as floats allow: shadow rays to a light, whose directions are `apex` −
  /// origin, each coordinate rounded once, with t_max ≤ 1. Others are answered too, but gain nothing.
  virtual void occluded_fan(Vec3 apex, std::span<const Ray> rays, std::span<std::uint8_t> hidden,
                            TraceLog log = {}) const;

  virtual AccelStats stats() const = 0;
};

/// The ray where it has just that t, and no other.
Ray only_at(const Ray& ray, float t);

/// Builds the structure. Precondition: `options.kind` isn't `automatic` (the plan settles that). `BuildStop` says how
/// that is stopped.
std::unique_ptr<const Accel> make_accel(std::shared_ptr<const Scene> scene, const AccelOptions& options);

}  // namespace tessera
