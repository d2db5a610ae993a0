#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/accel/accel.h"
#include "core/integrator/integrator.h"
#include "core/integrator/ray_counts.h"
#include "core/integrator/shading.h"
#include "core/integrator/shadow_batch.h"
#include "core/integrator/spawn.h"
#include "core/light/light_table.h"
#include "core/material/bsdf.h"
#include "core/plan/features.h"
#include "core/sampling/sampler.h"
#include "core/sampling/warp.h"
#include "core/scene/light.h"
#include "core/scene/material.h"
#include "tests/support/random.h"
#include "tests/support/recording_sampler.h"
#include "tests/support/scenes.h"

// The path tracer's own source once more, under another name and with a sampler that records what is drawn.
#define PathTracer RecordedPathTracer
#define PathSample RecordingSampler::Sample
#define Sampler RecordingSampler
#include "core/integrator/path.cpp"
#undef PathTracer
#undef PathSample
#undef Sampler

namespace tessera {
namespace {

/// All that a path can meet: every surface, rough and smooth, half transparent ones and layers of them, lights of every
/// kind, near and far, and a way out.
std::shared_ptr<const Scene> scene_of_everything() {
  SceneBuilder b;
  const std::array surfaces{Material{.surface = Diffuse{{0.9F, 0.9F, 0.9F}}},
                            Material{.surface = WhittedSurface{.specular = {0.3F, 0.3F, 0.3F}, .shininess = 20}},
                            Material{.surface = glass_material()},
                            Material{.surface = Conductor{{0.2F, 0.9F, 1.1F}, {3.9F, 2.4F, 2.2F}, 0}},
                            Material{.surface = Conductor{{0.2F, 0.9F, 1.1F}, {3.9F, 2.4F, 2.2F}, 0.5F}},
                            Material{.surface = Dielectric{1.5F, 0, {1, 1, 1}}},
                            Material{.surface = Dielectric{1.5F, 0.4F, {0.9F, 1, 1}}},
                            Material{.surface = MetallicRoughness{{0.9F, 0.6F, 0.3F}, 0.5F, 0.3F}},
                            Material{.emission = {3, 3, 3}, .emits_both_sides = true},
                            Material{.surface = Dielectric{}, .emission = {1, 1, 1}, .alpha = 0.5F},
                            Material{.surface = MetallicRoughness{}, .alpha = 0.3F},
                            Material{.alpha = 0}};
  Random random(1);
  for (std::size_t i = 0; i < 6 * surfaces.size(); ++i)
    b.add(random_shape(random, 3), b.material(surfaces[i % surfaces.size()]));
  // Most of the room's walls: paths get long enough for roulette.
  const auto wall = b.material(surfaces[0]);
  for (const float y : {-4.0F, 4.0F}) b.add(Quad{{{{-4, y, 4}, {4, y, 4}, {4, y, -4}, {-4, y, -4}}}}, wall);
  for (const float x : {-4.0F, 4.0F}) b.add(Quad{{{{x, -4, 4}, {x, 4, 4}, {x, 4, -4}, {x, -4, -4}}}}, wall);
  b.light(PointLight{{1, 3, 1}, {10, 10, 10}});
  b.light(SpotLight{.position = {-1, 3, 1}, .direction = -UnitVec3::y(), .intensity = {10, 10, 10}});
  b.light(DirectionalLight{-UnitVec3::z(), {1, 1, 1}});
  b.light(SunLight{.direction = -UnitVec3::z(), .irradiance = {2, 2, 2}, .angle = 0.1F});
  b.light(EnvironmentLight{.radiance = {0.5F, 0.5F, 0.5F}, .map = nullptr});
  return b.build();
}

/// STRESS 66.
TEST(PathDimensions, NoneIsDrawnTwiceWhateverThePathMeets_Stress66) {
  const auto scene = scene_of_everything();
  const auto accel = make_accel(scene, {AccelKind::bvh});
  const LightTable lights(scene);
  const RecordingSampler sampler(Sampler({.kind = SamplerKind::sobol, .replicates = 2}));
  std::vector<SampleId> samples;
  std::vector<Ray> rays;
  std::vector<Hit> hits;
  Random random(2);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    samples.push_back({static_cast<std::int32_t>(i % 20), static_cast<std::int32_t>(i / 200), i / 20 % 10});
    rays.push_back({to_float(random.in_cube()), to_float(random.direction())});
    hits.push_back(accel->closest(rays.back()).value_or(Hit{}));
  }
  std::vector<Rgb> radiance(rays.size());
  std::vector<float> covered(rays.size(), 1);
  RayCounts counts;
  RecordedPathTracer tracer(*scene, features_of(*scene), accel.get(), &lights, sampler, {.max_depth = 40}, counts);
  tracer.begin(samples, rays, hits, {radiance, covered});
  while (tracer.go_on()) {
  }
  for (const std::string& line : sampler.repeats()) ADD_FAILURE() << line;
  // All there is to decide has been decided, at the first vertex and far from it.
  for (const std::uint32_t vertex : {0U, 8U})
    for (const Decision d : {Decision::light_pick, Decision::light, Decision::bsdf_lobe, Decision::bsdf,
                             Decision::roulette, Decision::alpha})
      if (vertex > 0 || d != Decision::roulette) {
        EXPECT_GT(sampler.draws_of(dimension(vertex, d)), 0U) << vertex << ' ' << static_cast<int>(d);
      }
}

}  // namespace
}  // namespace tessera
