// Pictures of Khronos' sample models beside those of other renderers (glTF-Render-Fidelity), seen from the same place.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "core/io/image_io.h"
#include "core/io/read_texture.h"
#include "core/scene/studio.h"
#include "proto/parse.h"
#include "tests/support/files_beside.h"
#include "tests/support/image.h"
#include "tests/support/shared_data.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kSide = 128;
/// Their light is weaker than our studio's.
constexpr float kExposure = -1;
/// Blocks of pixels that are compared: shapes and colours count, not single highlights.
constexpr std::uint32_t kBlocks = 16;

/// Where the camera of that collection looks, from how far, and from which side: degrees around the y axis from +z, and
/// down from +y. It sees 45° from top to bottom. (Models of that
/// name have changed since: the truck here is turned by 90°, the box moved by 2.)
struct View {
  const char* model;
  const char* golden;
  Vec3 target;
  double theta, phi, radius;
};

const View kViews[] = {
    {"Box/glTF/Box.gltf", "Box", {0, 0, 2}, 30, 60, 2.38},
    {"BoxTextured-glTF/BoxTextured.gltf", "BoxTextured", {0, 0, 0}, 30, 60, 2.38},
    {"CesiumMilkTruck/glTF/CesiumMilkTruck.gltf", "CesiumMilkTruck", {0, 1.3F, 0}, 90, 90, 7.8},
    {"Duck/glTF/Duck.gltf", "Duck", {0, 0.86F, 0}, 0, 90, 2.7},
    {"FlightHelmet/FlightHelmet.gltf", "FlightHelmet", {0, 0.32F, 0}, 0, 90, 1},
    {"MultiUVTest/glTF/MultiUVTest.gltf", "MultiUVTest", {0, 0, 0}, 0, 90, 4.25},
    {"SimpleSparseAccessor/glTF/SimpleSparseAccessor.gltf", "SimpleSparseAccessor", {3, 2, 0}, 0, 90, 9},
    {"TextureSettingsTest/glTF/TextureSettingsTest.gltf", "TextureSettingsTest", {0, 0, 0}, 0, 90, 15},
    {"Triangle/glTF/Triangle.gltf", "Triangle", {0.5F, 0.5F, 0}, 0, 90, 1.5},
    {"TwoSidedPlane/glTF/TwoSidedPlane.gltf", "TwoSidedPlane", {0, 0, 0}, 0, 60, 3.5},
    {"UnlitTest/glTF/UnlitTest.gltf", "UnlitTest", {0, 0, 0}, 0, 90, 7},
    {"VertexColorTest/glTF/VertexColorTest.gltf", "VertexColorTest", {0, 0, 0}, 0, 90, 4},
};

/// Colours as they are shown, on white, block by block; 0..1.
using Blocks = std::vector<std::array<double, 3>>;

Blocks blocks_of(const Texels& image) {
  const auto& bytes = std::get<SharedValues<std::uint8_t>>(image.values);
  Blocks blocks(std::size_t{kBlocks} * kBlocks);
  for (std::uint32_t y = 0; y < image.height; ++y)
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const std::uint8_t* pixel = &bytes[(std::size_t{y} * image.width + x) * image.channels];
      const double alpha = image.channels == 4 ? pixel[3] / 255.0 : 1;
      auto& block = blocks[std::size_t{y * kBlocks / image.height} * kBlocks + x * kBlocks / image.width];
      for (std::size_t c = 0; c < 3; ++c)
        block[c] += (alpha * pixel[c] / 255 + 1 - alpha) * kBlocks * kBlocks / (double{1} * image.width * image.height);
    }
  return blocks;
}

/// Root mean square over all blocks and channels.
double difference(const Blocks& a, const Blocks& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) sum += (a[i][c] - b[i][c]) * (a[i][c] - b[i][c]);
  return std::sqrt(sum / (3.0 * static_cast<double>(a.size())));
}

std::optional<Blocks> read_blocks(std::vector<std::byte> file) {
  auto opened = open_texture(std::make_shared<const std::vector<std::byte>>(std::move(file)), 1 << 26);
  const auto* image = std::get_if<std::shared_ptr<const TextureImage>>(&opened);
  if (!image || (*image)->texels().width < kBlocks) return std::nullopt;
  return blocks_of((*image)->texels());
}

std::vector<Blocks> goldens(const fs::path& folder) {
  std::vector<Blocks> all;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
    if (auto blocks = read_blocks({first, first + bytes.size()})) all.push_back(*std::move(blocks));
  }
  return all;
}

PerspectiveCamera camera_of(const View& view) {
  const double theta = view.theta * std::numbers::pi / 180, phi = view.phi * std::numbers::pi / 180;
  const Vec3d way{std::sin(phi) * std::sin(theta), std::cos(phi), std::sin(phi) * std::cos(theta)};
  return {{view.target + to_float(way * view.radius), view.target, {0, 1, 0}}};
}

std::optional<Blocks> ours(const View& view, const fs::path& models) {
  const fs::path path = models / view.model;
  const std::string document = R"({"objects": [{"type": "file", "path": ")" + path.filename().string() +
                               R"("}], "lights": [{"type": "environment", "preset": "studio"}]})";
  const auto scene = proto::parse_scene(document, FilesBeside(path.parent_path()), {});
  if (!scene) return std::nullopt;
  Settings settings;
  settings.width = settings.height = kSide;
  settings.samples = 32;
  settings.transparent = true;
  settings.aovs = {Aov::alpha};
  const Image image = render_image(scene->scene, camera_of(view), settings);
  Encoding encoding{.look = {kExposure, ToneMap::khronos_pbr_neutral}, .transparent = true, .background = Rgb{1, 1, 1}};
  auto png = encode(image.pixels, kColorPlane, encoding);
  return png ? read_blocks(*std::move(png)) : std::nullopt;
}

/// On the whole their pictures are up to 0.067 from each other, and in two cases, by what a renderer got wrong, 0.17
/// and 0.33; their light is another than ours. What is upside down, of another colour or seen from another side is at
/// 0.2 and beyond: the truck from its side at 0.23, the box beside its place at 0.46.
constexpr double kThreshold = 0.13;
/// Of the plane they show the reflection of a window that our studio doesn't have.
constexpr double kThresholdOfReflection = 0.22;

TEST(GltfGoldens, PicturesAreLikeThoseOfOthers) {
  const auto data = shared_data();
  if (!data || !fs::is_directory(*data / "gltf-goldens")) GTEST_SKIP() << "no shared data";
  for (const View& view : kViews) {
    const auto picture = ours(view, *data / "gltf");
    ASSERT_TRUE(picture) << view.model;
    const std::vector<Blocks> others = goldens(*data / "gltf-goldens" / view.golden);
    ASSERT_FALSE(others.empty()) << view.golden;
    double nearest = 1;
    for (const Blocks& other : others) nearest = std::min(nearest, difference(*picture, other));
    const bool is_reflection = std::string_view(view.golden) == "TwoSidedPlane";
    EXPECT_LE(nearest, is_reflection ? kThresholdOfReflection : kThreshold) << view.golden;
  }
}

}  // namespace
}  // namespace tessera
