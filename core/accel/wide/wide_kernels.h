#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/accel/test_counts.h"
#include "core/accel/wide/wide_tree.h"
#include "core/math/ray_fan.h"
#include "core/math/transform.h"

namespace tessera {

/// Rays of a fan at most.
inline constexpr std::size_t kFanRays = 1024;

/// Rays of a stream at most; of more, `closest` and `occluded` make several. The more incoherent rays go together, the
/// longer they share nodes: random ones take 1.4 times as long in streams of 4096 on 100,000 triangles, 1.2 times on 2
/// million, and longer in larger ones, too, for which what is kept no longer fits into caches.
inline constexpr std::size_t kStreamRays = 32768;

/// What a ray does in a body that it may enter at t ≤ limit: `call` returns the new limit, or `kStop`.
struct BodyVisit {
  void* self;
  float (*call)(void* self, std::uint32_t body, float limit);
};

/// The same for several rays, by their numbers, whose limits are lowered.
struct BodyVisits {
  void* self;
  void (*call)(void* self, std::uint32_t body, std::span<const std::uint32_t> rays);
};

/// How rays are led through the `WideTree` of an object's mesh, compiled for one instruction set; all find the same
/// hits. Rays are in the mesh's own space, and traceable but for the fans'. `counts` is null, and counting costs
/// nothing, where nobody asks. Pure and safe from any number of threads.
struct WideKernels {
  const char* name;  ///< Highway's for the instruction set.

  /// Lowers `hits[i]` where ray i hits something less, by (t, object, primitive).
  void (*closest)(const WideTree&, std::uint32_t object, std::span<const Ray> rays, std::span<Hit> hits,
                  TestCounts* counts);

  /// The same for a ray and the triangles from `least.primitive` on alone, of the object `least.object`.
  void (*closest_from)(const WideTree&, PrimitiveId least, const Ray& ray, Hit& hit, TestCounts* counts);

  /// Sets `hidden[i]` where ray i hits anything; rays that are hidden already aren't traced.
  void (*occluded)(const WideTree&, std::uint32_t object, std::span<const Ray> rays, std::span<std::uint8_t> hidden,
                   TestCounts* counts);

  /// Visits bodies of a tree over boxes (`build_wide_over`), roughly from near to far, up to the ray's `t_max`.
  /// `placed` as for `cull_pad`.
  void (*visit_bodies)(const WideTree&, Transform::Error placed, const Ray& ray, BodyVisit visit, TestCounts* counts);

  /// The same for up to `kStreamRays` rays together, up to limits that start as their `t_max`, or `kStop`.
  void (*visit_bodies_together)(const WideTree&, Transform::Error placed, std::span<const Ray> rays,
                                std::span<float> limits, BodyVisits visits, TestCounts* counts);

  /// As `closest`, for up to `kFanRays` rays; those that are neighbours by sixteens should be so in space. False, and
  /// nothing done, where no picture can hold them: they point too far apart, some aren't traceable, or lengths are so
  /// large or small that a float's range gets in the way.
  bool (*closest_fan)(const WideTree&, std::uint32_t object, const RayFan& fan, std::span<Hit> hits,
                      TestCounts* counts);

  /// As `occluded`, for up to `kFanRays` rays that lead to `apex`: see `Accel::occluded_fan`. False as above, and where
  /// they don't.
  bool (*occluded_fan)(const WideTree&, std::uint32_t object, Vec3 apex, std::span<const Ray> rays,
                       std::span<std::uint8_t> hidden, TestCounts* counts);
};

/// The best for this machine, settled at the first call.
const WideKernels& wide_kernels();

/// All that this machine can run, for tests: the best first. Not to be called while `wide_kernels` may be.
std::vector<const WideKernels*> runnable_wide_kernels();

}  // namespace tessera
