#include "tests/benchmarks/support/recorded_rays.h"

#include "core/integrator/whitted.h"
#include "core/sampling/pixel_samples.h"
#include "tests/benchmarks/support/samples.h"

namespace tessera::bench {
namespace {

/// Passes rays on to a structure and keeps them. Which of the integrator's two kinds of `closest` a ray is shows in
/// the count that the integrator has raised just before. For one thread.
class RecordingAccel final : public Accel {
 public:
  RecordingAccel(const Accel& inner, const RayCounts& counts, RecordedRays& rays)
      : inner_(inner), counts_(counts), rays_(rays) {}

  std::optional<Hit> closest(const Ray& ray, TraceLog) const override {
    const bool reflected = counts_.reflection != rays_.of(RayKind::reflection).size();
    rays_.of(reflected ? RayKind::reflection : RayKind::refraction).push_back(ray);
    return inner_.closest(ray);
  }
  bool occluded(const Ray& ray, TraceLog) const override {
    rays_.of(RayKind::shadow).push_back(ray);
    return inner_.occluded(ray);
  }
  std::optional<Hit> closest_among(const Ray& ray, std::span<const std::uint32_t> objects, TraceLog) const override {
    return inner_.closest_among(ray, objects);
  }
  AccelStats stats() const override { return inner_.stats(); }

 private:
  const Accel& inner_;
  const RayCounts& counts_;
  RecordedRays& rays_;
};

}  // namespace

std::string_view name(RayKind kind) {
  switch (kind) {
    case RayKind::camera:
      return "camera";
    case RayKind::shadow:
      return "shadow";
    case RayKind::reflection:
      return "reflection";
    default:
      return "refraction";
  }
}

RecordedRays record_rays(const RenderContext& context) {
  RecordedRays rays;
  RayCounts counts;
  const Settings& settings = context.settings;
  const RecordingAccel recorder(*context.accel, counts, rays);
  Whitted integrator(*context.scene, context.plan.features, recorder, context.plan.max_depth, counts);
  const PixelOffsets offsets(settings.seed, settings.samples, settings.jitter);
  for (const Tile& tile : context.plan.tiling.tiles) {
    if (tile.first_level == FirstLevel::nothing) continue;
    for (std::int32_t y = tile.rect.y0; y < tile.rect.y1; ++y)
      for (std::int32_t x = tile.rect.x0; x < tile.rect.x1; ++x)
        for (std::uint32_t i = 0; i < settings.samples; ++i) {
          const PixelOffset at = offsets.of(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), i);
          const Ray ray = context.rays.ray(x + at.x, y + at.y);
          rays.of(RayKind::camera).push_back(ray);
          const Hit hit = context.accel->closest(ray).value_or(Hit{});
          Rgb radiance;
          integrator.radiance({&ray, 1}, {&hit, 1}, {&radiance, 1});
        }
  }
  return rays;
}

double trace_speed(const Accel& accel, RayKind kind, std::span<const Ray> rays) {
  std::uint64_t traced = 0, hits = 0;
  const Stopwatch watch;
  do {
    if (kind == RayKind::shadow)
      for (const Ray& ray : rays) hits += accel.occluded(ray) ? 1 : 0;
    else
      for (const Ray& ray : rays) hits += accel.closest(ray) ? 1 : 0;
    traced += rays.size();
  } while (watch.seconds() < 0.02);
  const double seconds = watch.seconds();
  // The hits are used, so that no compiler drops the work.
  return hits > traced ? 0 : 1e-6 * static_cast<double>(traced) / seconds;
}

}  // namespace tessera::bench
