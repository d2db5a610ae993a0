#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/accel/accel.h"
#include "core/integrator/ground_shadows.h"
#include "core/integrator/integrator.h"
#include "core/integrator/leaving_rays.h"
#include "core/integrator/ray_counts.h"
#include "core/integrator/shadow_batch.h"
#include "core/light/light_table.h"
#include "core/math/rgb.h"
#include "core/plan/features.h"
#include "core/sampling/sampler.h"
#include "core/scene/scene.h"

namespace tessera {

/// Path tracing (Kajiya 1986): at each surface a ray to a light and one that the surface chooses, weighed against each
/// other by the power heuristic (Veach & Guibas 1995). Paths have `max_depth` segments at most, the one to the light
/// counted; from the sixth on they end by Russian roulette.
///
/// A batch of paths goes on segment by segment. What a path brings is summed in the order of its segments.
class PathTracer final : public Integrator {
 public:
  struct Options {
    std::uint32_t max_depth = 16;
    bool hides_background = false;  ///< What the camera sees of it directly is black.
  };

  /// `features` are the scene's; `lights` is null where it has none. All have to outlive this.
  PathTracer(const Scene& scene, const Features& features, const Accel* accel, const LightTable* lights,
             const Sampler& sampler, const Options& options, RayCounts& counts, TraceLog log = {});

  std::size_t batch_size() const override { return 8192; }
  void begin(std::span<const SampleId> samples, RaySpan rays, std::span<const Hit> hits, Output out) override;
  bool go_on() override;

 private:
  struct Path {
    PathSample numbers;
    Rgb throughput{1, 1, 1};
    float eta_scale = 1;  ///< Takes the scaling of radiance by media out of the throughput.
    /// With which the last surface chose the direction; 0 where no light was sampled instead, so that what is met
    /// counts in full.
    float pdf = 0;
    LightTable::Viewpoint from{};  ///< Where lights were sampled at that surface.
    std::uint32_t sum = 0;         ///< Into `out`.
    std::uint32_t depth = 1;       ///< The number of its last segment.
    Rgb absorption{};              ///< Of what it is in, 1/m.
    bool is_direct = true;         ///< It has met nothing that isn't passed straight.
  };
  struct Vertex;

  /// How a path goes on: not at all, with a ray of its own, or with the same one behind what it has hit.
  enum class Next { nothing, its_ray, what_is_behind };

  /// Whether a camera ray that meets this can bring light, or go on.
  bool may_bring(const Hit& hit) const;
  void shade();
  Next shade_path(Path& path, Ray& ray, const Hit& hit);
  /// `direction` is the ray's, unit.
  Vertex vertex_at(const Ray& ray, Vec3 direction, const Hit& hit) const;
  /// What a black surface that isn't all there lets pass.
  static Next behind(Path& path, float alpha);
  void add_escaped(const Path& path, const Ray& ray, Vec3 direction);
  Rgb background(const Path& path, Vec3 direction) const;
  void add_emitted(const Path& path, const Vertex& at, float share);
  void sample_light(Path& path, const Vertex& at);
  /// Gives the path its next ray; false where it ends.
  bool scatter(Path& path, Ray& ray, const Vertex& at);
  /// 1/m, of what is behind a surface that the path passes.
  Rgb absorption_behind(const Path& path, const Vertex& at) const;
  static bool survives(Path& path, float number);
  void add(std::uint32_t sum, Rgb radiance) { out_.radiance[sum] = out_.radiance[sum] + radiance; }

  const Scene& scene_;
  const Accel* accel_;
  const LightTable* lights_;
  const Sampler& sampler_;
  Options options_;
  bool has_alpha_, has_textures_, has_ground_;
  bool has_sky_, has_emitters_, has_unlit_;  ///< Which rays can meet by chance.
  bool has_absorption_;
  RayCounts& counts_;
  TraceLog log_;
  Output out_;
  std::uint32_t vertex_ = 0;  ///< Of the paths, the first hit being 0.
  bool has_hits_ = false;     ///< Otherwise the rays are still to be traced.
  std::vector<Path> paths_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
  std::vector<Hit> passed_;  ///< For each ray, where there is alpha: see `find_behind`.
  LeavingRays leaving_;
  ShadowBatch shadows_;
  GroundShadows ground_;
};

}  // namespace tessera
