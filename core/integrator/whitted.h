#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <unordered_map>
#include <vector>

#include "core/accel/accel.h"
#include "core/integrator/direct_light.h"
#include "core/integrator/integrator.h"
#include "core/integrator/ray_counts.h"
#include "core/math/rgb.h"
#include "core/plan/features.h"
#include "core/scene/scene.h"

namespace tessera {

struct Shading;

/// Whitted's ray tracer (CACM 1980): at each hit, every light that the surface faces and that nothing hides; then,
/// where the material asks for them, the mirrored and the refracted ray, down to `max_depth` rays in a chain. A ray
/// that hits nothing brings the background. Chains end earlier by `kSmallestThroughput` and `kMostSecondary`.
///
/// Rays go in batches: what the hits of one batch ask for is traced together, and a batch never grows. Each ray's
/// radiance is summed in the same order whatever batch it is in. For one thread at a time: memory is kept from batch to
/// batch.
class Whitted final : public Integrator {
 public:
  /// A secondary ray isn't traced if what it brings back would be weighed, by all surfaces between it and the camera,
  /// with less than this in each channel (after Hall & Greenberg's adaptive tree depth, CG&A 1983). That is less than
  /// half the last bit of a float: nothing beside what is as bright.
  static constexpr float kSmallestThroughput = 0x1p-25F;

  /// Secondary rays that one camera ray leads to, at most: weights of 1 never fade, and two branches at each of 64
  /// surfaces don't end. A chain of single rays has room for any depth; two full branches have it for eleven.
  static constexpr std::uint32_t kMostSecondary = 4096;

  /// `features` are the scene's. `log` is told what is tested.
  Whitted(const Scene& scene, const Features& features, const Accel& accel, std::uint32_t max_depth, RayCounts& counts,
          TraceLog log = {});

  /// Enough for structures to gain from rays that go together, few enough for all that is known of them to stay in the
  /// caches.
  std::size_t batch_size() const override { return 1024; }
  void begin(std::span<const SampleId> samples, RaySpan rays, std::span<const Hit> hits, Output out) override;
  bool go_on() override;

  /// All of it at once. No random number is drawn, so it doesn't matter of which samples the rays are.
  void radiance(std::span<const Ray> rays, std::span<const Hit> hits, std::span<Rgb> out);

 private:
  /// How a ray came about.
  struct Chain {
    Rgb throughput{1, 1, 1};                    ///< The product of the weights from the camera to it.
    std::uint32_t most_below = kMostSecondary;  ///< Rays that may follow from it.
  };

  /// Rays that hits ask for, and the sums that they add to.
  struct Spawned {
    void clear();
    void add(const Ray& ray, const Chain& chain, Rgb weight, std::uint32_t sum);

    std::vector<Ray> rays;
    std::vector<Chain> chains;
    std::vector<Rgb> weights;
    std::vector<std::uint32_t> sums;
    std::vector<Hit> hits;
    std::vector<Rgb> radiance;
  };

  /// The batch of one depth, and how far it has come: lights first, then what its hits have spawned.
  struct Level {
    std::span<Rgb> sums;
    std::vector<LitPoint> points;
    std::deque<WhittedSurface> varied;  ///< Those of points whose materials aren't the same all over.
    std::size_t next_light;
    std::array<Spawned, 2> spawned;  ///< By mirrors, and by refraction.
    std::size_t next_spawned;
  };

  void enter(RaySpan rays, std::span<const Hit> hits, std::span<const Chain> chains, std::span<Rgb> out);
  void leave();
  void shade_hit(const Ray& ray, const Hit& hit, const Chain& chain, std::uint32_t sum, Level& level);
  const WhittedSurface& surface_of(const Ray& ray, const Hit& hit, Level& level);
  static void spawn(const WhittedSurface& material, const Shading& at, const LitPoint& point, const Chain& chain,
                    Level& level);
  void trace(Spawned& spawned);

  const Scene& scene_;
  std::unordered_map<std::uint32_t, WhittedSurface> converted_;  ///< By material: those met that aren't Whitted's own.
  bool casts_shadows_;
  const Accel& accel_;
  std::uint32_t max_depth_;
  RayCounts& counts_;
  TraceLog log_;
  DirectLight direct_light_;
  std::vector<Chain> camera_chains_;  ///< All alike.
  std::deque<Level> levels_;          ///< By depth; none moves when one is added.
  std::size_t depth_ = 0;             ///< Levels in use; of the rays in the last one's chains, the camera's included.
};

}  // namespace tessera
