// Promise 1 of the design: one image, whatever the way.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/accel_choices.h"
#include "tests/support/effort.h"
#include "tests/support/image.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

Settings all_planes(std::uint32_t width, std::uint32_t height, std::uint32_t samples) {
  Settings s;
  s.width = width;
  s.height = height;
  s.samples = samples;
  s.aovs = {Aov::depth, Aov::normal, Aov::primitive_id, Aov::object_id};
  return s;
}

struct View {
  const char* name;
  std::shared_ptr<const Scene> scene;
  Camera camera;
};

/// A mesh and a skewed instance of it, fine enough to project in parts, with nothing around.
std::shared_ptr<const Scene> meshes_scene() {
  SceneBuilder b;
  b.material(diffuse({0.7F, 0.6F, 0.5F}));
  b.background({0.2F, 0.3F, 0.1F}).light(PointLight{{2, 3, 4}, {30, 30, 30}});
  const auto ball = b.shape(icosphere(3));
  b.place(ball).place(ball, 0, placed({0.4, 0.3, 0, 1.2, -0.2, 0.7, 0.1, 1.3, 0, 0, -0.3, 1}));
  return b.build();
}

std::vector<View> views() {
  PerspectiveCamera inside{{{0.1F, 0.1F, 0.2F}, {0, 0, 5}, {0, 1, 0}}, 1.2F};
  return {{"mixed", mixed_scene(), mixed_camera()},
          {"mixed, parallel", mixed_scene(), orthographic_camera()},
          {"mixed, from inside the mirror", mixed_scene(), inside},
          {"sparse", sparse_scene(), mixed_camera()},
          {"meshes", meshes_scene(), mixed_camera()},
          {"random", random_scene(7, 40), PerspectiveCamera{{{0, 0, 25}, {0, 0, 0}, {0, 1, 0}}, 0.9F}},
          {"empty", SceneBuilder().background({0.1F, 0.7F, 0.3F}).build(), mixed_camera()}};
}

TEST(Images, AreTheSameWhateverTheStructureTilesAndThreads_Stress52) {
  const auto sizes = {1U, 7U, 16U, 64U, 66U, kAdaptiveTiles};  // 66: the whole image
  for (const View& view : views()) {
    Settings settings = all_planes(66, 35, static_cast<std::uint32_t>(effort(1, 2)));
    settings.accel.kind = AccelKind::brute;
    settings.screen_bounds = ScreenBounds::off;
    settings.tile_size = 66;
    const Image reference = render_image(view.scene, view.camera, settings);
    for (const AccelKind accel : {AccelKind::brute, AccelKind::bvh, AccelKind::automatic})
      for (const ScreenBounds bounds : {ScreenBounds::off, ScreenBounds::flat, ScreenBounds::hierarchical})
        for (const std::uint32_t size : sizes)
          for (const int threads : {1, 2, 3, 8}) {
            if (accel != AccelKind::automatic && threads != 3 && !long_tests()) continue;
            settings.accel.kind = accel;
            settings.screen_bounds = bounds;
            settings.tile_size = size;
            const Image image = render_image(view.scene, view.camera, settings, threads);
            ASSERT_TRUE(same_bytes(reference.pixels, image.pixels))
                << view.name << ", " << accel_name(accel) << ", screen bounds " << static_cast<int>(bounds)
                << ", tiles of " << size << ", " << threads << " threads";
            RayCounts all = image.rays;
            all.camera += all.camera_skipped;
            all.camera_skipped = 0;
            EXPECT_EQ(all, reference.rays) << view.name;
          }
  }
}

/// Every structure × bound × space with every use of screen areas; tile sizes and threads in turn.
TEST(Images, AreTheSameInEveryStructureAndBound_Stress54) {
  constexpr std::array kSizes{7U, kAdaptiveTiles, 16U, 1U, 64U};
  for (const View& view : views()) {
    const int side = effort(24, 200);
    Settings settings = all_planes(static_cast<std::uint32_t>(side * 3 / 2), static_cast<std::uint32_t>(side), 1);
    settings.accel.kind = AccelKind::brute;
    settings.screen_bounds = ScreenBounds::off;
    settings.tile_size = 512;
    const Image reference = render_image(view.scene, view.camera, settings);
    std::size_t turn = 0;
    for (const AccelOptions& options : accel_choices())
      for (const ScreenBounds bounds : {ScreenBounds::off, ScreenBounds::flat, ScreenBounds::hierarchical}) {
        settings.accel = options;
        settings.screen_bounds = bounds;
        settings.tile_size = kSizes[++turn % kSizes.size()];
        const Image image = render_image(view.scene, view.camera, settings, static_cast<int>(1 + turn % 3));
        ASSERT_TRUE(same_bytes(reference.pixels, image.pixels))
            << view.name << ", " << describe(options) << ", screen bounds " << static_cast<int>(bounds) << ", tiles of "
            << settings.tile_size;
      }
  }
}

/// Cameras and filters whose samples see more, or less, than a pinhole through its own pixel.
TEST(Images, AreTheSameThroughLensesFiltersAndClipping_Stress42_Stress64) {
  auto through = std::get<PerspectiveCamera>(mixed_camera());
  through.lens = {0.8F, 2};
  auto clipped = through;
  clipped.clipping = {3.5F, 6};
  auto calibrated = std::get<PerspectiveCamera>(mixed_camera());
  calibrated.intrinsics = Intrinsics{25, 15, 10, 12};
  calibrated.clipping = {4, kInfinity};
  auto parallel = std::get<OrthographicCamera>(orthographic_camera());
  parallel.clipping = {4, 7};
  for (const Camera& camera : {Camera(through), Camera(clipped), Camera(calibrated), Camera(parallel)})
    for (const auto& scene : {mixed_scene(), sparse_scene(), meshes_scene()})
      for (const FilterKind filter : {FilterKind::box, FilterKind::gaussian, FilterKind::blackman_harris}) {
        Settings settings = all_planes(24, 16, 2);
        settings.filter = filter;
        settings.filter_width = filter == FilterKind::box ? 3.5F : 0;
        settings.accel.kind = AccelKind::brute;
        settings.screen_bounds = ScreenBounds::off;
        const Image reference = render_image(scene, camera, settings);
        for (const AccelKind accel : {AccelKind::bvh, AccelKind::wide})
          for (const ScreenBounds bounds : {ScreenBounds::flat, ScreenBounds::hierarchical})
            for (const std::uint32_t size : {kAdaptiveTiles, 7U}) {
              settings.accel.kind = accel;
              settings.screen_bounds = bounds;
              settings.tile_size = size;
              const Image image = render_image(scene, camera, settings, 2);
              ASSERT_TRUE(same_bytes(reference.pixels, image.pixels))
                  << accel_name(accel) << ", screen bounds " << static_cast<int>(bounds) << ", tiles of " << size
                  << ", filter " << static_cast<int>(filter);
            }
      }
}

/// What is in focus looks as a pinhole shows it, and what isn't looks otherwise.
TEST(Images, AreBlurredOutOfFocusAlone_Stress64) {
  SceneBuilder b;
  b.light(AmbientLight{{1, 1, 1}});
  b.add(Quad{{{{-3, -3, 0}, {0.01F, -3, 0}, {0.01F, 3, 0}, {-3, 3, 0}}}}, b.material(diffuse({1, 1, 1})));
  const auto scene = b.build();
  PerspectiveCamera camera{{{0, 0, 4}, {0, 0, 0}, {0, 1, 0}}, 0.8F};
  Settings settings = all_planes(33, 33, 64);
  const Image sharp = render_image(scene, camera, settings);
  camera.lens = {0.5F, 4};
  const Image focused = render_image(scene, camera, settings);
  camera.lens = {0.5F, 2};
  const Image blurred = render_image(scene, camera, settings);
  EXPECT_EQ(sharp.pixels.color, focused.pixels.color);
  // Twice as far away as the lens focuses, its diameter of a metre blurs over a metre, of 33 / (8 · tan 0.4) pixels.
  const auto grey = [](const Image& image) {
    int pixels = 0;
    for (std::size_t x = 0; x < 33; ++x) {
      const float value = image.pixels.color[16 * 33 + x].r;
      if (value > 0 && value < 1) ++pixels;
    }
    return pixels;
  };
  EXPECT_LE(grey(sharp), 1);
  EXPECT_NEAR(grey(blurred), 33 / (8 * std::tan(0.4)), 2);
}

/// Tiles in any order, some begun and stopped before, some rendered twice.
TEST(Images, AreTheSameAfterStopsAndRetries_Stress53) {
  Settings settings = all_planes(48, 32, 2);
  settings.tile_size = 7;
  const Image reference = render_image(mixed_scene(), mixed_camera(), settings);
  for (const AccelEntry& row : accel_table()) {
    settings.accel.kind = row.kind;
    const auto scene = mixed_scene();
    Plan plan = make_plan(*scene, mixed_camera(), settings);
    const auto accel = std::shared_ptr(make_accel(scene, plan.accel));
    const RenderContext context{scene, accel, settings, plan, CameraRays(mixed_camera(), 48, 32)};
    std::vector<PixelRect> rects;
    for (const Tile& tile : plan.tiling.tiles) rects.push_back(tile.rect);
    Film film(48, 32, settings.aovs, rects);
    Random random(53);
    for (std::size_t left = rects.size(); left-- > 0;) {
      std::stop_source stop;
      stop.request_stop();
      if (random.bits() % 2) {
        EXPECT_FALSE(render_tile(context, left, stop.get_token()));
      }
      if (random.bits() % 2) render_tile(context, random.bits() % rects.size());
      film.store(left, render_tile(context, left)->pixels);
    }
    EXPECT_TRUE(same_bytes(reference.pixels, film.pixels())) << row.name;
  }
}

TEST(Images, SkipRaysWhereNothingProjects) {
  Settings settings = all_planes(64, 64, 2);
  const Image image = render_image(sparse_scene(), mixed_camera(), settings);
  EXPECT_GT(image.rays.camera_skipped, 64U * 64U);
  EXPECT_GT(image.rays.camera_hits, 0U);
  EXPECT_EQ(image.rays.camera + image.rays.camera_skipped, 64U * 64U * 2U);
}

TEST(Images, ShowOffScreenObjectsInMirrors_Stress43) {
  SceneBuilder b;
  const auto mirror = b.material(mirror_material());
  const auto red = b.material(diffuse({1, 0, 0}));
  b.light(AmbientLight{{1, 1, 1}});
  b.add(Quad{{{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}}}, mirror);
  b.add(Sphere{{0, 0, 10}, 3}, red);  // behind the camera
  const auto scene = b.build();
  const Camera camera = PerspectiveCamera{{{0, 0, 2}, {0, 0, 0}, {0, 1, 0}}, 0.2F};
  Settings settings;
  settings.width = settings.height = 5;
  settings.jitter = false;
  const Image image = render_image(scene, camera, settings);
  EXPECT_FLOAT_EQ(image.pixels.color[12].r, 0.9F);
  EXPECT_EQ(image.pixels.color[12].g, 0);
  EXPECT_EQ(make_plan(*scene, camera, settings).tiling.objects_on_screen, 1U);
}

TEST(Images, HoldNoNanInfinityOrNegative_Stress60) {
  for (const View& view : views())
    for (const Rgb& c : render_image(view.scene, view.camera, all_planes(48, 48, 4)).pixels.color)
      ASSERT_TRUE(is_finite(c) && c.r >= 0 && c.g >= 0 && c.b >= 0) << view.name;
}

TEST(Images, ChangeWithTheSeed) {
  Settings settings = all_planes(32, 32, 2);
  const Image a = render_image(mixed_scene(), mixed_camera(), settings);
  settings.seed = 1;
  EXPECT_FALSE(same_bytes(a.pixels, render_image(mixed_scene(), mixed_camera(), settings).pixels));
}

}  // namespace
}  // namespace tessera
