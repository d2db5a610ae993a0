#pragma once

#include <memory>
#include <vector>

#include "core/accel/accel.h"
#include "core/accel/wide/bodies.h"
#include "core/accel/wide/lazy_tree.h"
#include "core/accel/wide/ray_batch.h"
#include "core/accel/wide/wide_kernels.h"
#include "core/accel/wide/wide_tree.h"

namespace tessera {

/// The structure for speed: a wide hierarchy over each mesh, searched by kernels for this machine's instruction set,
/// and one over the bodies, which are the objects here (`JoinedAccel` has fewer). A mesh gets its hierarchy
/// when the first ray enters the box of a body that it is the shape of; if that fails, whatever the ray was traced by
/// throws.
class WideAccel final : public Accel {
 public:
  WideAccel(std::shared_ptr<const Scene> scene, const AccelOptions& options,
            const WideKernels& kernels = wide_kernels(), MakeTree make = build_tree);

  static MadeTree build_tree(const TriangleMesh& mesh);

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
  friend class JoinedAccel;

  /// Of these bodies, by whose numbers everything goes then: all but `TraceLog::tested` is `JoinedAccel`'s to carry
  /// over.
  WideAccel(Bodies bodies, const WideKernels& kernels, MakeTree make);
  /// The first hit at just that t of primitives with this number or a greater one.
  std::optional<Hit> closest_at(const Ray& ray, float t, PrimitiveId least, TraceLog log) const;

  /// Calls `visit(body, limit)`, which returns the new limit or `kStop`, for bodies that the ray may enter.
  template <typename Visit>
  void visit_bodies(const Ray& ray, TraceLog log, Visit&& visit) const;
  /// Answers many rays, all traceable, on their way through the hierarchy over bodies together. A fan's leave one
  /// point.
  template <typename Answer>
  void search_together(std::span<const Ray> rays, std::span<Answer> answers, TraceLog log, bool is_fan) const;
  const WideTree& mesh_tree(const Bodies::Body& body) const;
  /// Those that rays which lead to a point may meet on their way.
  std::vector<std::uint32_t> bodies_to(Vec3 apex, std::span<const Ray> rays) const;
  /// `closest_fan` where the fan's interval is all that is before its origin.
  void closest_endless(const RayFan& fan, std::span<Hit> hits, TraceLog log, Candidates among) const;
  /// Whether batches go through bodies one by one.
  static bool are_few(std::size_t bodies, std::size_t rays);
  /// Whether nothing has been made yet for the object's mesh, and these rays need nothing: none enters its box.
  bool pass_by(std::uint32_t body, std::span<const Ray> rays) const;
  /// Among the primitives from `least` on.
  void closest_in(std::uint32_t body, const Ray& world, Hit& best, TraceLog log, std::uint32_t least = 0) const;
  bool occluded_by(std::uint32_t body, const Ray& world, TraceLog log) const;
  /// Whether a mesh in the world's own space is all there is: then nothing has to be picked.
  bool is_lone_mesh() const;

  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log,
                std::optional<Vec3> apex) const;
  /// Picks the rays that may hit a body, if any, and says so to the log.
  template <typename Answer>
  bool pick(std::uint32_t body, RayBatch<Answer>& batch, TraceLog log) const;

  // One body, whose rays are in its own space; answers are bettered. For a mesh, those that aren't a fan's are
  // traceable.
  void closest_on(std::uint32_t body, std::span<const Ray> rays, std::span<Hit> hits, TestCounts* counts) const;
  void closest_on_mesh(std::uint32_t body, const RayFan& fan, std::span<Hit> hits, TestCounts* counts) const;
  void occluded_on(std::uint32_t body, std::optional<Vec3> apex, std::span<const Ray> rays,
                   std::span<std::uint8_t> hidden, TestCounts* counts) const;

  Bodies bodies_;
  const WideKernels& kernels_;
  std::vector<Aabb> boxes_;
  std::vector<std::uint32_t> all_;  ///< Bodies' numbers, where they are so few that any batch may go through them.
  WideTree tree_;                   ///< Over the boxes.
  const MakeTree make_;
  std::vector<LazyTree> meshes_;  ///< By hierarchy; never asked for where there is no mesh.
  Transform::Error placed_;
};

/// The structure for speed over a scene, of which some meshes may be joined.
std::unique_ptr<const Accel> make_wide(std::shared_ptr<const Scene> scene, const AccelOptions& options,
                                       const WideKernels& kernels, MakeTree make);

}  // namespace tessera
