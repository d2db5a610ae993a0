// Denormal coordinates give the same image whether or not the host's threads flush them to zero.
#include <algorithm>
#include <cstring>

#include <gtest/gtest.h>

#include "core/accel/accel_table.h"
#include "core/scene/frame_scene.h"
#include "tests/support/flush_to_zero.h"
#include "tests/support/image.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

/// A ball of 1e-40, as it is beside one of 1, and enlarged to 1.
std::shared_ptr<const Scene> tiny_ball_scene() {
  SceneBuilder b;
  b.material(diffuse({0.7F, 0.6F, 0.5F}));
  b.background({0.2F, 0.3F, 0.1F}).light(DirectionalLight{UnitVec3::normalize(Vec3{1, -2, -1}).value(), {1, 1, 1}});
  const auto ball = b.shape(icosphere(2, 1e-40F));
  b.place(ball).add(Sphere{{2, 0, 0}, 1});
  return b.place(ball, 0, placed({1e40, 0, 0, -1, 0, 1e40, 0, 0, 0, 0, 1e40, 0})).build();
}

TEST(Denormals, GiveTheSameImageWhetherOrNotTheyAreFlushed_Stress20) {
  if (!FlushToZero::kKnown) GTEST_SKIP() << "no switch to flush to zero is known for this machine";
  const Camera camera = PerspectiveCamera{{{0, 0, 6}, {0, 0, 0}, {0, 1, 0}}, 0.9F};
  Settings settings;
  settings.width = settings.height = 48;
  settings.aovs = {Aov::depth, Aov::normal, Aov::primitive_id, Aov::object_id};
  for (const AccelEntry& entry : accel_table())
    for (const ScreenBounds bounds : {ScreenBounds::off, ScreenBounds::flat, ScreenBounds::hierarchical}) {
      settings.accel.kind = entry.kind;
      settings.screen_bounds = bounds;
      const Image kept = render_image(tiny_ball_scene(), camera, settings);
      EXPECT_GT(std::ranges::count(kept.pixels.plane<std::uint32_t>(Aov::object_id), 2U), 100)
          << "the enlarged ball is seen";
      const auto scene = tiny_ball_scene();
      const FlushToZero on;
      const Image flushed = render_image(scene, camera, settings);
      EXPECT_TRUE(same_bytes(kept.pixels, flushed.pixels))
          << entry.name << ", screen bounds " << static_cast<int>(bounds);
    }
}

/// A lamp whose coordinates, and whose power, are denormal: the table of lights is made of them.
TEST(Denormals, LightTheSame_Stress20) {
  if (!FlushToZero::kKnown) GTEST_SKIP() << "no switch to flush to zero is known for this machine";
  const auto scene = [] {
    SceneBuilder b;
    b.material(Material{.surface = Diffuse{{0.7F, 0.6F, 0.5F}}});
    const auto lamp = b.material(Material{.emission = {5, 5, 5}, .emits_both_sides = true});
    b.add(Sphere{{0, 0, 0}, 1}).light(PointLight{{0, 3, 3}, {1e-39F, 2e-39F, 1e-39F}});
    return b.place(b.shape(icosphere(1, 1e-40F)), lamp, placed({5e39, 0, 0, -1, 0, 5e39, 0, 2, 0, 0, 5e39, 1})).build();
  };
  Settings settings;
  settings.width = settings.height = 32;
  settings.samples = 4;
  settings.integrator = IntegratorKind::path;
  settings.filter = FilterKind::gaussian;
  const Camera camera = PerspectiveCamera{{{0, 0, 6}, {0, 0, 0}, {0, 1, 0}}, 0.9F};
  const Image kept = render_image(scene(), camera, settings);
  const auto again = scene();
  const FlushToZero on;
  EXPECT_TRUE(same_bytes(kept.pixels, render_image(again, camera, settings).pixels));
}

TEST(Denormals, FrameASceneTheSame_Stress20) {
  if (!FlushToZero::kKnown) GTEST_SKIP() << "no switch to flush to zero is known for this machine";
  const auto scene = SceneBuilder().add(icosphere(2, 1e-40F)).build();
  const auto kept = std::get<PerspectiveCamera>(frame_scene(*scene, 40, 30));
  const FlushToZero on;
  const auto flushed = std::get<PerspectiveCamera>(frame_scene(*scene, 40, 30));
  EXPECT_EQ(std::memcmp(&kept.view.from, &flushed.view.from, sizeof(Vec3)), 0);
}

}  // namespace
}  // namespace tessera
