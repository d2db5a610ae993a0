#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/light/emissive_surface.h"
#include "core/light/infinite_lights.h"
#include "core/light/light_tree.h"
#include "core/math/ray.h"
#include "core/math/vec2.h"
#include "core/scene/scene.h"

namespace tessera {

/// A direction in which a light may be seen.
struct LightSample {
  Vec3 to_light;   ///< Unit.
  float distance;  ///< Infinite where the light is infinitely far away.
  Rgb radiance;  ///< W/(sr m²), if nothing stands in between; of a delta light the irradiance on a plane that faces it.
  float pdf;     ///< Per solid angle; of a delta light the probability of picking it. > 0 and finite.
  bool is_delta;  ///< A point or a direction, which no ray meets by chance.

  // For `LightTable::shadow_ray`.
  Vec3d position;         ///< Of the point that was chosen, unless `distance` is infinite.
  PrimitiveId primitive;  ///< That it lies on, or none.
};

/// All lights of a scene that the path tracer knows: point lights that fall off, spots, directional lights, suns, the
/// environment (or the background), and objects that emit. What is sampled are the lights themselves, and of objects
/// triangles, quads, spheres and disks, each primitive a light of its own, unless their alpha varies;
/// those without area, and what is black, never are. Where lights are both near and infinitely far away, each kind is
/// picked about in proportion to the irradiance from it; one of those far away as `InfiniteLights` says, one of the
/// others by a `LightTree`.
///
/// Densities are those of the one sample that `sample` gives from the same viewpoint. Immutable, safe from any thread.
class LightTable {
 public:
  explicit LightTable(std::shared_ptr<const Scene> scene);

  /// Whether there is nothing to sample.
  bool empty() const { return count() == 0; }
  /// How many lights may be picked.
  std::uint64_t count() const { return std::uint64_t{near_.size()} + far_.size(); }

  /// That it takes, beside the scene.
  std::size_t bytes() const;

  /// Where light is looked for.
  struct Viewpoint {
    Vec3d point{};
    Vec3 normal{};
    InfiniteLights::Sum far{};  ///< What may come from infinitely far away,
    double far_share = 0;       ///< and how often that is picked.
  };
  /// `normal`, the shading normal, is unit where only light from its side counts (a surface that lets nothing pass),
  /// and zero otherwise.
  Viewpoint viewpoint(Vec3d point, Vec3 normal) const;

  /// `u` in [0, 1)², and `pick` in [0, 1), what follows u.x beyond the precision of floats. u.x picks the light, and
  /// what is left of it within what is that light's takes its place: so pairs that are well spread are so over all
  /// lights together. Nothing when what these fall on sends nothing to that point.
  std::optional<LightSample> sample(const Viewpoint& from, float pick, Vec2 u) const;

  /// From a point beside the surface that `from` lay on: occluded exactly when something stands between it and the
  /// light; the light itself doesn't. Its direction isn't of length 1.
  Ray shadow_ray(const LightSample& sample, Vec3 origin) const;

  /// The density with which `sample` gives `direction` (unit), in which a ray from there meets the primitive at
  /// `distance`; 0 for one that isn't sampled. Finite.
  float pdf_hit(const Viewpoint& from, Vec3 direction, PrimitiveId primitive, double distance,
                Vec3d geometric_normal) const;

  /// Whether a ray can meet an object that emits; false only where it can't.
  bool may_meet(const Ray& ray) const;

  struct Escaped {
    Rgb radiance;
    float pdf;  ///< With which `sample` gives that direction, infinitely far away. Finite.
  };
  /// What a ray from there that meets nothing sees, `direction` being unit.
  Escaped escaped(const Viewpoint& from, Vec3 direction) const;

 private:
  void gather_emitters();
  /// Fills the sources.
  LightTree gather_near();
  std::optional<LightSample> sample_far(const Viewpoint& from, double pick, Vec2 u) const;
  /// Of a light of the scene that is near.
  std::optional<LightSample> sample_point(std::uint32_t light, Vec3d from) const;
  std::optional<LightSample> sample_near(const Viewpoint& from, double pick, Vec2 u) const;
  float end_at(PrimitiveId primitive, const Ray& ray) const;
  /// A mesh's triangle, as it lies in the world.
  const WorldTriangle* triangle_of(std::uint32_t source) const;

  std::shared_ptr<const Scene> scene_;
  InfiniteLights far_;
  std::vector<PrimitiveId> sources_;  ///< Those of the tree; of a light of the scene its index, `object` being none.
  std::vector<std::uint32_t> first_;  ///< For each object the source that its first primitive is, or none.
  std::vector<Aabb> emitters_;        ///< Boxes of objects that emit, with room for all roundings; one for all if many.
  std::vector<WorldTriangle> triangles_;  ///< For each source; empty where none is a mesh's triangle.
  struct SpotCosines {
    double inner, outer;
  };
  std::vector<SpotCosines> spots_;        ///< For each light of the scene; empty where none is a spot.
  std::vector<Transform::Error> errors_;  ///< For each object that emits, of its placement.
  LightTree near_;
};

/// The same in the floating-point environment that images are made in.
std::shared_ptr<const LightTable> make_lights(std::shared_ptr<const Scene> scene);

}  // namespace tessera
