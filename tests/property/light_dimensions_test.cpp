// STRESS 66: no random number decides two things. The integrators are compiled once more here, with a sampler that
// records what they draw in the place of theirs.
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "core/accel/accel.h"
#include "core/integrator/integrator.h"
#include "core/integrator/shading.h"
#include "core/integrator/shadow_batch.h"
#include "core/integrator/spawn.h"
#include "core/light/light_table.h"
#include "core/material/bsdf.h"
#include "core/plan/features.h"
#include "core/sampling/warp.h"
#include "core/screen/camera_rays.h"
#include "tests/support/light_images.h"
#include "tests/support/recording_sampler.h"
#include "tests/support/scenes.h"

#define Sampler RecordingSampler
#define PathSample RecordingSampler::Sample
#define PathTracer RecordedPathTracer
#define AmbientOcclusion RecordedAmbientOcclusion
#include "core/integrator/ambient_occlusion.cpp"
#include "core/integrator/path.cpp"
#undef Sampler
#undef PathSample
#undef PathTracer
#undef AmbientOcclusion

namespace tessera {
namespace {

/// A room in which paths are long and meet everything: every material, half of them not all there, and every light.
std::shared_ptr<const Scene> busy_room() {
  SceneBuilder b;
  const Surface surfaces[] = {Diffuse{grey(0.9F)},
                              Dielectric{1.5F},
                              Dielectric{1.5F, 0.4F},
                              Conductor{grey(0.2F), grey(3), 0.3F},
                              MetallicRoughness{{0.9F, 0.9F, 0.9F}, 0, 0.2F},
                              WhittedSurface{grey(0.4F), grey(0.3F), 9, grey(0.2F), grey(0.2F), 1.2F}};
  for (const Surface& surface : surfaces)
    for (const float alpha : {1.0F, 0.6F})
      b.material(Material{
          .surface = surface, .emission = grey(alpha < 1 ? 0.1F : 0), .emits_both_sides = true, .alpha = alpha});
  b.material(Material{.surface = Diffuse{{}}, .emission = grey(1), .alpha = 0.5F});
  b.background({0.2F, 0.3F, 0.4F}).light(PointLight{{0.3F, 0.2F, 0.1F}, {1, 1, 1}});
  b.light(SunLight{-UnitVec3::z(), {1, 1, 1}, 0.2F}).light(SpotLight{{0, 0, 1}, -UnitVec3::z(), {2, 2, 2}, 0.2F, 0.9F});
  b.light(DirectionalLight{*UnitVec3::normalize(Vec3{1, 1, -1}), {1, 1, 1}});
  b.add(Sphere{{0, 0, 0}, 3}, 1);
  for (std::uint32_t i = 0; i < 13; ++i) {
    const double turn = 2.4 * i;
    const Vec3 at = to_float(Vec3d{std::cos(turn) * 1.3, std::sin(turn) * 1.3, 0.15 * i - 1});
    if (i % 2)
      b.add(icosphere(1, 0.5F, at), i);
    else
      b.add(Sphere{at, 0.5F}, i);
  }
  return b.build();
}

TEST(LightDimensions, NoneIsDrawnTwiceAlongAPath_Stress66) {
  constexpr std::uint32_t kSide = 12, kSamples = 4;
  const auto scene = busy_room();
  const auto accel = make_accel(scene, {AccelKind::bvh});
  const LightTable lights(*scene);
  const CameraRays camera(PerspectiveCamera{{{0, 0.1F, 0}, {1, 0.3F, 0.1F}, {0, 0, 1}}, 2}, kSide, kSide);
  for (const SamplerKind kind : {SamplerKind::independent, SamplerKind::sobol})
    for (const bool is_path : {true, false}) {
      const RecordingSampler sampler(Sampler({.kind = kind, .samples = kSamples}));
      RayCounts counts;
      std::unique_ptr<Integrator> integrator;
      if (is_path)
        integrator = std::make_unique<RecordedPathTracer>(*scene, features_of(*scene), accel.get(), lights, sampler,
                                                          RecordedPathTracer::Options{40}, counts);
      else
        integrator = std::make_unique<RecordedAmbientOcclusion>(*scene, accel.get(), sampler, kInfinity, counts);
      std::vector<SampleId> samples;
      std::vector<Ray> rays;
      std::vector<Hit> hits;
      for (std::int32_t pixel = 0; pixel < std::int32_t{kSide * kSide}; ++pixel)
        for (std::uint32_t i = 0; i < kSamples; ++i) {
          samples.push_back({pixel % std::int32_t{kSide}, pixel / std::int32_t{kSide}, i});
          const PixelOffset at = sampler.film(samples.back());
          rays.push_back(camera.ray(samples.back().x + at.x, samples.back().y + at.y));
          hits.push_back(accel->closest(rays.back()).value_or(Hit{}));
        }
      std::vector<Rgb> radiance(samples.size());
      std::vector<float> covered(samples.size(), 1);
      integrator->begin(samples, rays, hits, {radiance, covered});
      while (integrator->go_on()) continue;
      EXPECT_EQ(sampler.repeats(), std::vector<std::string>()) << "sampler " << static_cast<int>(kind);
      // The film's pair, and of a path up to seven numbers at each of several vertices.
      EXPECT_GT(sampler.draws(), samples.size() * (is_path ? 20 : 3));
    }
}

}  // namespace
}  // namespace tessera
