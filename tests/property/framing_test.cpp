// Auto-framing, judged by the images themselves: nothing at the border, and no more room than the margin.
#include <gtest/gtest.h>

#include "core/scene/frame_scene.h"
#include "tests/support/image.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

/// The rectangle of pixels in which anything is seen.
struct Covered {
  std::uint32_t left = 0xFFFFFFFF, right = 0, top = 0xFFFFFFFF, bottom = 0;
};

Covered covered(const Pixels& pixels, std::uint32_t width, std::uint32_t height) {
  Covered out;
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x) {
      if (pixels.plane<std::uint32_t>(Aov::object_id)[std::size_t{y} * width + x] == kNoId) continue;
      out = {std::min(out.left, x), std::max(out.right, x), std::min(out.top, y), std::max(out.bottom, y)};
    }
  return out;
}

std::vector<std::pair<const char*, std::shared_ptr<const Scene>>> scenes() {
  SceneBuilder row;
  const auto ball = row.shape(icosphere(2));
  for (int i = 0; i < 9; ++i) row.place(ball, 0, placed({1, 0, 0, 3.0 * i, 0, 1, 0, 0, 0, 0, 1, 0}));
  const auto box = [](float size) {
    SceneBuilder b;
    for (int axis = 0; axis < 3; ++axis)
      for (const float side : {-size, size}) {
        std::array<Vec3, 4> corners;
        for (std::size_t i = 0; i < 4; ++i) {
          corners[i][axis] = side;
          corners[i][(axis + 1) % 3] = i == 1 || i == 2 ? size : -size;
          corners[i][(axis + 2) % 3] = i >= 2 ? size : -size;
        }
        b.add(Quad{corners});
      }
    return b.build();
  };
  return {{"ball", SceneBuilder().add(Sphere{{0, 0, 0}, 1}).build()},
          {"ball of triangles", SceneBuilder().add(icosphere(3)).build()},
          {"box", box(1)},
          {"large box", box(1e15F)},
          {"small box", box(1e-15F)},
          {"cone", SceneBuilder().add(Cone{{1, 2, 3}, 2, {1, 8, 3}, 0}).build()},
          {"cylinder", SceneBuilder().add(Cylinder{{0, 0, 0}, {20, 1, 0}, 0.5F}).build()},
          {"floor", SceneBuilder().add(Quad{{{{-4, 0, 4}, {4, 0, 4}, {4, 0, -4}, {-4, 0, -4}}}}).build()},
          {"disk", SceneBuilder().add(Disk{{1, 1, 1}, *UnitVec3::normalize(Vec3{0, 1, 1}), 3}).build()},
          {"row of instances", row.build()}};
}

TEST(Framing, AllIsInTheImageAndFillsIt) {
  const View from_the_left{{0, 0, 0}, {1, -0.3F, 0.2F}, {0, 0, 1}, false};
  const std::vector<Camera> cameras{kUnplacedCamera, OrthographicCamera{kUnplacedView},
                                    PerspectiveCamera{from_the_left, 0.02F}, PerspectiveCamera{from_the_left, 1},
                                    OrthographicCamera{from_the_left}};
  for (const auto& [name, scene] : scenes())
    for (const auto& [width, height] : {std::pair{100U, 400U}, {400U, 100U}, {200U, 200U}, {30U, 900U}, {900U, 30U}})
      for (const Camera& wanted : cameras) {
        Settings settings;
        settings.width = width;
        settings.height = height;
        settings.aovs = {Aov::object_id};
        const Image image = render_image(scene, frame_scene(*scene, width, height, wanted), settings);
        const Covered part = covered(image.pixels, width, height);
        const auto what = std::string(name) + ", " + std::to_string(width) + "x" + std::to_string(height) +
                          ", camera " + std::to_string(&wanted - cameras.data());
        EXPECT_TRUE(part.left > 0 && part.right < width - 1 && part.top > 0 && part.bottom < height - 1) << what;
        const double across = static_cast<double>(part.right) + 1 - part.left,
                     upright = static_cast<double>(part.bottom) + 1 - part.top;
        // A camera that sees more than a corner's own angle would have to stand on it to fill the image.
        const auto* pinhole = std::get_if<PerspectiveCamera>(&wanted);
        if (pinhole && std::tan(pinhole->vertical_fov / 2) * std::max(1.0, static_cast<double>(width) / height) > 1.5)
          continue;
        const double margin = std::max(1.0, 0.04 * std::min(width, height));
        EXPECT_GT(std::max(across - width, upright - height), -2 * margin - 3) << what;
        const double aside = std::abs(static_cast<double>(part.left) - (width - 1.0 - part.right)),
                     aloft = std::abs(static_cast<double>(part.top) - (height - 1.0 - part.bottom));
        EXPECT_LT(std::min(aside / width, aloft / height), 0.05) << what << ": in the middle";
      }
}

}  // namespace
}  // namespace tessera
