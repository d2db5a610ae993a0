#include "core/render/render.h"

#include <gtest/gtest.h>

#include "tests/support/image.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

Settings small() {
  Settings s;
  s.width = s.height = 16;
  s.aovs = {Aov::depth, Aov::normal, Aov::primitive_id, Aov::object_id};
  s.jitter = false;
  return s;
}

const Camera kAbove = OrthographicCamera{{{0, 5, 0}, {0, 0, 0}, {0, 0, -1}}, 4};

TEST(Render, RecordsWhatThePixelsFirstSampleMeets) {
  TriangleMesh quad;
  quad.positions = {{-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}};
  quad.triangles = {{0, 1, 2}, {0, 2, 3}};
  const auto scene = SceneBuilder().add(Sphere{{50, 0, 0}, 1}).add(quad).build();
  const Pixels p = render_image(scene, kAbove, small()).pixels;
  const std::size_t inside = p.index(9, 6), outside = p.index(1, 1);  // x > −z: the second triangle's side
  EXPECT_EQ(p.plane<float>(Aov::depth)[inside], 5);
  EXPECT_EQ(p.plane<Vec3>(Aov::normal)[inside], (Vec3{0, 1, 0}));
  EXPECT_EQ(p.plane<std::uint32_t>(Aov::object_id)[inside], 1U);
  EXPECT_EQ(p.plane<std::uint32_t>(Aov::primitive_id)[p.index(10, 8)], 0U);
  EXPECT_EQ(p.plane<std::uint32_t>(Aov::primitive_id)[p.index(5, 7)], 1U);
  EXPECT_EQ(p.plane<float>(Aov::depth)[outside], kInfinity);
  EXPECT_EQ(p.plane<std::uint32_t>(Aov::object_id)[outside], kNoId);
}

TEST(Render, AveragesSamples) {
  SceneBuilder b;
  b.material(diffuse({1, 1, 1}));
  b.light(AmbientLight{{1, 1, 1}}).background({0, 0, 0});
  // Covers the left half of the image, its edge through the middle of column 8 of 16: half of that pixel.
  const auto scene = b.add(Quad{{{{-9, 0, 9}, {0.125F, 0, 9}, {0.125F, 0, -9}, {-9, 0, -9}}}}).build();
  Settings settings = small();
  settings.jitter = true;
  settings.samples = 64;
  const Pixels p = render_image(scene, kAbove, settings).pixels;
  EXPECT_EQ(p.color[p.index(7, 8)].r, 1);
  EXPECT_EQ(p.color[p.index(8, 8)].r, 0.5F) << "8 × 8 strata, the edge between two columns of them";
  EXPECT_EQ(p.color[p.index(9, 8)].r, 0);
}

/// STRESS 63: each sample belongs to one pixel, and all weigh alike.
TEST(Render, WhatIsConstantStaysSoUnderEveryFilterAndSampler_Stress63) {
  SceneBuilder b;
  const auto shining = b.material(Material{.emission = {0.1F, 0.7F, 3}});
  const auto scene = b.add(Quad{{{{-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}}}}, shining).build();
  for (const auto filter : {FilterKind::box, FilterKind::gaussian, FilterKind::blackman_harris})
    for (const auto sampler : {SamplerKind::independent, SamplerKind::sobol})
      for (const std::uint32_t samples : {1U, 3U, 64U}) {
        Settings settings = small();
        settings.jitter = true;
        settings.integrator = IntegratorKind::path;
        settings.max_depth = 1;
        settings.filter = filter;
        settings.filter_width = 3;
        settings.sampler = sampler;
        settings.samples = samples;
        const Pixels p = render_image(scene, kAbove, settings).pixels;
        EXPECT_NEAR(p.color[0].g, 0.7, 1e-6);
        for (const Rgb& color : p.color) EXPECT_EQ(color, p.color[0]);
      }
}

/// Answers as `inner` does, and says that a closest hit took 3 volumes and 2 primitives, an occlusion test
/// 10 and 5.
class Counting final : public Accel {
 public:
  explicit Counting(std::unique_ptr<const Accel> inner) : inner_(std::move(inner)) {}

  std::optional<Hit> closest(const Ray& ray, TraceLog log) const override {
    count(log, {3, 2, 2, 1, 1});
    return inner_->closest(ray);
  }
  std::optional<Hit> closest_among(const Ray& ray, std::span<const std::uint32_t> objects,
                                   TraceLog log) const override {
    count(log, {3, 2, 2, 1, 1});
    return inner_->closest_among(ray, objects);
  }
  bool occluded(const Ray& ray, TraceLog log) const override {
    count(log, {10, 9, 5, 1, 4});
    return inner_->occluded(ray);
  }
  std::optional<Hit> coincident(const Ray& ray, const Hit& hit, TraceLog) const override {
    return inner_->coincident(ray, hit);
  }
  AccelStats stats() const override { return {}; }

 private:
  static void count(TraceLog log, const TestCounts& tests) {
    if (log.counts) *log.counts += tests;
  }
  std::unique_ptr<const Accel> inner_;
};

/// A lit quad over the left half of the image: a camera ray and a shadow ray where it is, a camera ray elsewhere.
TileResult counted(Settings settings) {
  SceneBuilder b;
  b.material(diffuse({1, 1, 1}));
  b.light(DirectionalLight{-UnitVec3::y(), {1, 1, 1}});
  const auto scene = b.add(Quad{{{{-9, 0, 9}, {0, 0, 9}, {0, 0, -9}, {-9, 0, -9}}}}).build();
  settings.tile_size = 16;
  settings.samples = 4;
  settings.screen_bounds = ScreenBounds::off;
  const Plan plan = make_plan(*scene, kAbove, settings);
  const RenderContext context{scene, std::make_shared<const Counting>(make_accel(scene, plan.accel)), settings, plan,
                              CameraRays(kAbove, 16, 16)};
  return *render_tile(context, 0);
}

TEST(Render, CostsAreAllTestsOfAPixelsRaysPerSample) {
  Settings settings = small();
  settings.aovs = {Aov::cost_volumes, Aov::cost_primitives};
  const TileResult tile = counted(settings);
  const Pixels& p = tile.pixels;
  EXPECT_EQ(p.plane<float>(Aov::cost_volumes)[p.index(3, 5)], 3 + 10) << "the camera's ray and the shadow ray";
  EXPECT_EQ(p.plane<float>(Aov::cost_primitives)[p.index(3, 5)], 2 + 5);
  EXPECT_EQ(p.plane<float>(Aov::cost_volumes)[p.index(12, 5)], 3);
  EXPECT_EQ(p.plane<float>(Aov::cost_primitives)[p.index(12, 5)], 2);
  const std::uint64_t camera = 16 * 16 * 4, shadow = 8 * 16 * 4;
  EXPECT_EQ(tile.tests, (TestCounts{camera * 3 + shadow * 10, camera * 2 + shadow * 9, camera * 2 + shadow * 5,
                                    camera + shadow, camera + shadow * 4}));
}

TEST(Render, CountsOnlyWhenAsked) {
  Settings settings = small();
  EXPECT_FALSE(counts_tests(settings));
  EXPECT_EQ(counted(settings).tests, TestCounts());
  settings.count_tests = true;
  EXPECT_GT(counted(settings).tests.volume_tests, 0U);
  EXPECT_TRUE(counted(settings).pixels.plane<float>(Aov::cost_volumes).empty());
}

TEST(Render, BackgroundThatIsKnownCostsNothing) {
  Settings settings = small();
  settings.aovs = {Aov::cost_volumes, Aov::cost_primitives};
  settings.tile_size = 4;
  const Pixels p = render_image(SceneBuilder().add(Sphere{{1, 0, 1}, 0.25F}).build(), kAbove, settings).pixels;
  EXPECT_EQ(p.plane<float>(Aov::cost_volumes)[p.index(1, 1)], 0);
  EXPECT_EQ(p.plane<float>(Aov::cost_primitives)[p.index(1, 1)], 0);
}

TEST(Render, BillionsOfBackgroundSamplesAreSummedInAMoment) {
  Settings settings = small();
  settings.width = settings.height = 1;
  const Camera away = PerspectiveCamera{View{{0, 0, 9}, {0, 0, 99}}};
  const auto scene = SceneBuilder().add(Sphere{{0, 0, 0}, 1}).background({1, 0.75F, 0}).build();
  settings.samples = 1000;
  EXPECT_EQ(render_image(scene, away, settings).pixels.color[0], (Rgb{1, 0.75F, 0}));
  settings.samples = 4294967295;
  const Rgb color = render_image(scene, away, settings).pixels.color[0];
  EXPECT_EQ(color.r, 0x1p24F / 0x1p32F) << "a float counts to 2^24, one by one, and the mean divides by 2^32";
  EXPECT_EQ(color.b, 0);
}

TEST(Render, StopsWhenTold_Stress53) {
  const auto scene = mixed_scene();
  Plan plan = make_plan(*scene, mixed_camera(), small());
  const RenderContext context{scene, make_accel(scene, plan.accel), small(), plan, CameraRays(mixed_camera(), 16, 16)};
  std::stop_source stop;
  EXPECT_TRUE(render_tile(context, 0, stop.get_token()));
  stop.request_stop();
  EXPECT_FALSE(render_tile(context, 0, stop.get_token()));
  const auto again = render_tile(context, 0), and_again = render_tile(context, 0);
  EXPECT_TRUE(same_bytes(again->pixels, and_again->pixels));
}

}  // namespace
}  // namespace tessera
