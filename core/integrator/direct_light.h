#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/accel/accel.h"
#include "core/integrator/ray_counts.h"
#include "core/math/rgb.h"
#include "core/scene/scene.h"

namespace tessera {

/// A point whose light is asked for.
struct LitPoint {
  const WhittedSurface* material;
  /// Beside the surface, on the viewer's side. This and what follows isn't read unless lights cast shadows.
  Vec3 origin;
  /// The same of the smooth surface that a mesh's normals stand for; `origin` without any. Where a light is beneath the
  /// triangle and yet above that surface, the triangle mustn't hide it: its shadow rays start here.
  Vec3 smooth_origin;
  PrimitiveId surface;
  Vec3 flat_normal;   ///< Unit, on the viewer's side.
  Vec3 normal;        ///< Unit, on the viewer's side.
  Vec3 to_viewer;     ///< Unit.
  std::uint32_t sum;  ///< The place of its sum.
};

/// What arrives at points straight from the lights, and leaves towards the viewer. All the shadow rays to a light are
/// traced at once. For one thread at a time: it keeps its memory from call to call.
class DirectLight {
 public:
  DirectLight(const Accel& accel, RayCounts& counts, TraceLog log);

  /// Adds the radiance (W/(sr m²)) that comes from one light of the scene to the points' sums. Precondition: the light
  /// is one of Whitted's: from a point, directional or ambient.
  void add(const Light& light, std::span<const LitPoint> points, std::span<Rgb> sums);

 private:
  void add_ambient(const AmbientLight& light, std::span<const LitPoint> points, std::span<Rgb> sums);
  template <typename Source>
  void add_unhidden(const Source& light, std::span<const LitPoint> points, std::span<Rgb> sums);
  void trace(const PointLight& light);
  void trace(const DirectionalLight& light);

  /// What a point reflects of a light, unless the light is hidden.
  struct Lit {
    Rgb radiance;
    std::uint32_t sum;
    const LitPoint* lifted;  ///< Set where its shadow ray starts on the smooth surface.
  };

  /// No light may leak through what lies between a mesh and the smooth surface that it stands for.
  void hide_what_leaks();

  const Accel& accel_;
  RayCounts& counts_;
  TraceLog log_;
  std::vector<Ray> rays_;
  std::vector<Lit> lit_;  ///< For each ray.
  std::vector<std::uint8_t> hidden_;
  std::vector<std::size_t> bridged_;  ///< Of `lit_`: those with a ray between the two origins of their points.
  std::vector<std::uint8_t> blocked_;
};

}  // namespace tessera
