#pragma once

#include <memory>
#include <vector>

#include "core/accel/accel.h"
#include "core/accel/bound_tree.h"
#include "core/accel/wide/lazy_tree.h"
#include "core/accel/wide/ray_batch.h"
#include "core/accel/wide/wide_kernels.h"
#include "core/accel/wide/wide_tree.h"
#include "core/bounds/box_bound.h"

namespace tessera {

/// The structure for speed: a wide hierarchy over each mesh, searched by kernels for this machine's instruction set,
/// and a binary one over the objects. A mesh gets its hierarchy when the first ray enters the box of an object that it
/// is the shape of; if that fails, whatever the ray was traced by throws.
class WideAccel final : public Accel {
 public:
  WideAccel(std::shared_ptr<const Scene> scene, const AccelOptions& options,
            const WideKernels& kernels = wide_kernels(), MakeTree make = build_tree);

  std::optional<Hit> closest(const Ray& ray, TraceLog log) const override;
  bool occluded(const Ray& ray, TraceLog log) const override;
  std::optional<Hit> closest_among(const Ray& ray, std::span<const std::uint32_t> objects, TraceLog log) const override;
  std::optional<Hit> coincident(const Ray& ray, const Hit& hit, TraceLog log) const override;
  void closest(std::span<const Ray> rays, std::span<Hit> hits, TraceLog log, Candidates among) const override;
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const override;
  void closest_fan(const RayFan& fan, std::span<Hit> hits, TraceLog log, Candidates among) const override;
  void occluded_fan(Vec3 apex, std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const override;
  AccelStats stats() const override;

 private:
  static MadeTree build_tree(const TriangleMesh& mesh);

  const WideTree& tree(std::uint32_t shape) const {
    return meshes_[shape].get(std::get<TriangleMesh>(scene_->shapes[shape]), make_);
  }
  bool is_mesh(const Object& object) const;
  /// Objects that rays which lead to a point may meet on their way.
  std::vector<std::uint32_t> objects_to(Vec3 apex, std::span<const Ray> rays) const;
  /// `closest_fan` where the fan's interval is all that is before its origin.
  void closest_endless(const RayFan& fan, std::span<Hit> hits, TraceLog log, Candidates among) const;
  /// Whether batches go through objects one by one.
  static bool are_few(std::span<const std::uint32_t> objects, std::size_t rays);
  /// Whether nothing has been made yet for the object's mesh, and these rays need nothing: none enters its box.
  bool pass_by(std::uint32_t object, std::span<const Ray> rays) const;
  void closest_in(std::uint32_t object, const Ray& world, Hit& best, TraceLog log) const;
  bool occluded_by(std::uint32_t object, const Ray& world, TraceLog log) const;
  /// Whether a mesh in the world's own space is all there is: then nothing has to be picked.
  bool is_lone_mesh() const;

  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log,
                std::optional<Vec3> apex) const;
  /// Picks the rays that may hit an object, if any, and says so to the log.
  template <typename Answer>
  bool pick(std::uint32_t object, RayBatch<Answer>& batch, TraceLog log) const;

  // One object, whose rays are in its own space; answers are bettered. For a mesh, those that aren't a fan's are
  // traceable.
  void closest_on(std::uint32_t object, std::span<const Ray> rays, std::span<Hit> hits, TestCounts* counts) const;
  void closest_on_mesh(std::uint32_t object, const RayFan& fan, std::span<Hit> hits, TestCounts* counts) const;
  void occluded_on(std::uint32_t object, std::optional<Vec3> apex, std::span<const Ray> rays,
                   std::span<std::uint8_t> hidden, TestCounts* counts) const;

  std::shared_ptr<const Scene> scene_;
  const WideKernels& kernels_;
  std::vector<Aabb> boxes_;
  std::vector<std::uint32_t> all_;  ///< Objects' numbers.
  BoundTree<BoxBound> objects_;
  const MakeTree make_;
  std::vector<LazyTree> meshes_;  ///< By shape; never asked for where that isn't a mesh.
  Transform::Error placed_;
};

}  // namespace tessera
