#include "tests/benchmarks/support/many_lights.h"

#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "core/accel/accel.h"
#include "core/integrator/spawn.h"
#include "core/light/emissive_surface.h"
#include "core/light/light_table.h"
#include "core/plan/plan.h"
#include "core/screen/camera_rays.h"
#include "proto/parse.h"
#include "tests/benchmarks/support/error_curve.h"
#include "tests/support/files_beside.h"
#include "tests/support/random.h"

namespace tessera::bench {
namespace {

constexpr std::uint32_t kTriangles = 100'000;
constexpr std::uint32_t kRenderSamples = 64, kSamples = 64, kReferenceSamples = 512;
constexpr int kRepetitions = 3;

/// Irradiance, one light a sample, at the points that camera rays hit; on one thread.
class DirectLight {
 public:
  explicit DirectLight(std::shared_ptr<const Scene> scene)
      : scene_(std::move(scene)), table_(scene_), random_(1), shadow_rays_(kPixels), sent_(kPixels), hidden_(kPixels) {
    Settings settings;
    settings.width = settings.height = kLightSide;
    accel_ = make_accel(scene_, make_plan(*scene_, *scene_->camera, settings).accel);
    const CameraRays camera(*scene_->camera, kLightSide, kLightSide);
    for (std::uint32_t i = 0; i < kPixels; ++i) {
      const Ray ray = camera.ray(i % kLightSide + 0.5, i / kLightSide + 0.5);
      const auto hit = accel_->closest(ray);
      if (!hit) continue;
      SurfacePoint point = world_surface(*scene_, hit->object, hit->primitive, ray, hit->t);
      if (dot(point.geometric_normal, to_double(ray.direction)) > 0) point.geometric_normal = -point.geometric_normal;
      points_.push_back({i, point, spawn_origin(point, point.geometric_normal), to_float(point.geometric_normal)});
    }
    for (std::uint32_t object = 0; object < scene_->objects.size(); ++object) {
      const Object& placed = scene_->objects[object];
      if (scene_->materials[placed.material].emission.is_black()) continue;
      const auto count = std::get<TriangleMesh>(scene_->shapes[placed.shape]).triangles.size();
      for (std::uint32_t i = 0; i < count; ++i) emitters_.push_back({object, i});
    }
  }

  enum class Pick { by_table, uniformly };

  FloatImage render(Pick pick, std::uint32_t samples) {
    FloatImage image{kLightSide, kLightSide, std::vector<Rgb>(kPixels)};
    for (std::uint32_t s = 0; s < samples; ++s) {
      for (std::size_t i = 0; i < points_.size(); ++i) prepare(pick, i);
      accel_->occluded(std::span(shadow_rays_).first(points_.size()), std::span(hidden_).first(points_.size()));
      for (std::size_t i = 0; i < points_.size(); ++i)
        if (hidden_[i] == 0)
          image.pixels[points_[i].pixel] =
              image.pixels[points_[i].pixel] + sent_[i] * (1 / static_cast<float>(samples));
    }
    return image;
  }

 private:
  static constexpr std::uint32_t kPixels = kLightSide * kLightSide;
  struct Point {
    std::uint32_t pixel;
    SurfacePoint surface;
    Vec3 origin, normal;
  };

  float one() { return static_cast<float>(random_.bits() >> 40) * 0x1p-24F; }

  /// The shadow ray of the sample at a point, and what comes along it if nothing is in the way.
  void prepare(Pick pick, std::size_t i) {
    const Point& point = points_[i];
    const float light = one();
    const Vec2 u{one(), one()};
    const auto sample = pick == Pick::by_table
                            ? table_.sample(table_.viewpoint(to_double(point.origin), point.normal), light, u)
                            : sample_uniformly(point, light, u);
    shadow_rays_[i] = Ray{point.origin, {0, 0, 0}, 0, 0};  // not traceable: costs nothing
    sent_[i] = {};
    if (!sample) return;
    const float cosine = dot(point.normal, sample->to_light);
    if (!(cosine > 0)) return;
    shadow_rays_[i] = table_.shadow_ray(*sample, point.origin);
    sent_[i] = sample->radiance * (cosine / sample->pdf);
  }

  std::optional<LightSample> sample_uniformly(const Point& point, float pick, Vec2 u) const {
    const double count = static_cast<double>(emitters_.size());
    const PrimitiveId primitive = emitters_[static_cast<std::size_t>(pick * count)];
    const auto on_it = sample_surface(*scene_, primitive, to_double(point.origin), u);
    if (!on_it || !on_it->front) return std::nullopt;
    const double distance = length(on_it->way);
    return LightSample{to_float(on_it->way / distance),
                       static_cast<float>(distance),
                       scene_->materials[scene_->objects[primitive.object].material].emission,
                       static_cast<float>(on_it->pdf / count),
                       false,
                       to_double(point.origin) + on_it->way,
                       primitive};
  }

  std::shared_ptr<const Scene> scene_;
  LightTable table_;
  std::unique_ptr<const Accel> accel_;
  Random random_;
  std::vector<Point> points_;
  std::vector<PrimitiveId> emitters_;
  std::vector<Ray> shadow_rays_;
  std::vector<Rgb> sent_;
  std::vector<std::uint8_t> hidden_;
};

double seconds_a_sample(Tessera& tessera, const LightScene& scene) {
  tessera.render(scene, {{"samples", 1}});  // builds the structure
  Samples seconds;
  for (int i = 0; i < kRepetitions; ++i)
    seconds.add(tessera.render(scene, {{"samples", kRenderSamples}, {"seed", i}}).seconds / kRenderSamples);
  return seconds.median();
}

/// How much greater the error (RMSE) of picking uniformly is, at equal time.
double error_ratio(const LightScene& scene, const std::filesystem::path& folder) {
  const auto parsed = proto::parse_scene(scene.document.dump(), FilesBeside(folder), proto::Limits());
  if (!parsed) throw std::runtime_error(scene.name + " is refused: " + parsed.problem().detail);
  using Pick = DirectLight::Pick;
  DirectLight light(parsed->scene);
  const FloatImage half = light.render(Pick::by_table, kReferenceSamples);
  const LongReference reference(half, light.render(Pick::by_table, kReferenceSamples));
  const auto efficiency = [&](Pick pick) {
    const CpuStopwatch watch;
    const FloatImage image = light.render(pick, kSamples);
    return 1 / (watch.seconds() * reference.error(image));
  };
  return std::sqrt(efficiency(Pick::by_table) / efficiency(Pick::uniformly));
}

}  // namespace

void measure_many_lights(Report& report, const std::filesystem::path& folder, Tessera& tessera) {
  const LightScene many = lamp_scene(folder, kTriangles), one = lamp_scene(folder, 0);
  const double many_seconds = seconds_a_sample(tessera, many), one_seconds = seconds_a_sample(tessera, one);
  const double ratio = error_ratio(many, folder);
  print_table({{"emitters", "ms a sample"},
               {"one quad", three_digits(1e3 * one_seconds)},
               {std::to_string(kTriangles), three_digits(1e3 * many_seconds)}});
  std::printf("picked uniformly, the error of their direct light is %.1f times as great at equal time\n", ratio);
  report.figures()["many_lights"] = {
      {"one_seconds", one_seconds}, {"many_seconds", many_seconds}, {"uniform_error_over_ours", ratio}};
  report.at_most("convergence/many_lights/seconds_over_one", many_seconds / one_seconds, 2);
  report.at_least("convergence/many_lights/uniform_error_over_ours", ratio, 3);
}

}  // namespace tessera::bench
