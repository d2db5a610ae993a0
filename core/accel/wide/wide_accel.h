#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "core/accel/accel.h"
#include "core/accel/bound_tree.h"
#include "core/accel/wide/wide_kernels.h"
#include "core/accel/wide/wide_tree.h"
#include "core/bounds/box_bound.h"

namespace tessera {

/// The structure for speed: a wide hierarchy over each mesh, searched by kernels for this machine's instruction set,
/// and a binary one over the objects.
class WideAccel final : public Accel {
 public:
  WideAccel(std::shared_ptr<const Scene> scene, const AccelOptions& options,
            const WideKernels& kernels = wide_kernels());

  std::optional<Hit> closest(const Ray& ray, TraceLog log) const override;
  bool occluded(const Ray& ray, TraceLog log) const override;
  std::optional<Hit> closest_among(const Ray& ray, std::span<const std::uint32_t> objects, TraceLog log) const override;
  void closest(std::span<const Ray> rays, std::span<Hit> hits, TraceLog log) const override;
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const override;
  void closest_fan(std::span<const Ray> rays, std::span<Hit> hits, TraceLog log) const override;
  void occluded_fan(Vec3 apex, std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const override;
  AccelStats stats() const override;

 private:
  const WideTree& tree(std::uint32_t shape) const { return meshes_[shape]; }
  void closest_in(std::uint32_t object, const Ray& world, Hit& best, TraceLog log) const;
  bool occluded_by(std::uint32_t object, const Ray& world, TraceLog log) const;
  /// The one mesh that is all there is, in the world's own space; null if there is more.
  const WideTree* lone_mesh() const;

  std::shared_ptr<const Scene> scene_;
  const WideKernels& kernels_;
  std::vector<Aabb> boxes_;
  BoundTree<BoxBound> objects_;
  std::vector<WideTree> meshes_;  ///< By shape; empty for what isn't a mesh.
  Transform::Error placed_;
};

}  // namespace tessera
