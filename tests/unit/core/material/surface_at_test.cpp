#include "core/material/surface_at.h"

#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/textures.h"

namespace tessera {
namespace {

using Transform2 = std::array<float, 6>;
constexpr Transform2 kAsItIs{1, 0, 0, 0, 1, 0};

/// A square from (0, 0) to (1, 1) in the plane z = 0, on which an image lies as one sees it from above: u to the right,
/// v downwards.
Scene square(std::shared_ptr<const TextureImage> image, const TextureUse& use, const Transform2& transform,
             std::vector<Tangent> tangents = {}) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  MeshAttributes attributes;
  attributes.uvs[0] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  attributes.tangents = std::move(tangents);
  mesh.attributes = std::make_shared<const MeshAttributes>(std::move(attributes));
  Scene scene;
  scene.shapes.emplace_back(std::move(mesh));
  scene.objects.push_back({});
  scene.materials.push_back({});
  scene.materials[0].textures = {use};
  scene.textures.push_back({});
  scene.textures[0].image = std::move(image);
  scene.textures[0].transform = transform;
  return scene;
}

/// The shading normal at (0.75, 0.25), u = v = 3/4, stretched to z = 1.
Vec3d normal_of(const Scene& scene) {
  SurfacePoint point{};
  point.geometric_normal = point.shading_normal = {0, 0, 1};
  point.second_share = 0.5;
  point.third_share = 0.25;
  surface_at(scene, scene.objects[0], 0, point);
  return point.shading_normal / point.shading_normal.z;
}

void expect_near(Vec3d a, Vec3d b, const char* what) {
  EXPECT_NEAR(a.x, b.x, 1e-4) << what;
  EXPECT_NEAR(a.y, b.y, 1e-4) << what;
}

/// Normals that lean to the right and half as far up in the image.
Vec3d normal_map(const Transform2& transform, std::vector<Tangent> tangents = {}) {
  const auto image = image_of({1, 1, 3, std::vector<float>{1, 0.75F, 1}});
  return normal_of(square(image, {TextureSlot::normal, 0, 0, 1}, transform, std::move(tangents)));
}

TEST(SurfaceAt, NormalMapsLieAsTheirImagesDo) {
  expect_near(normal_map(kAsItIs), {1, 0.5, 1}, "as it is");
  expect_near(normal_map({-1, 0, 1, 0, 1, 0}), {-1, 0.5, 1}, "mirrored");
  expect_near(normal_map({1, 0, 0, 0, -2, 1}), {1, -0.5, 1}, "upside down, and smaller");
  // The image's right edge is where v is 0: at the top.
  expect_near(normal_map({0, -1, 1, 1, 0, 0}), {-0.5, 1, 1}, "turned");
}

TEST(SurfaceAt, GlossinessIsWhatRoughnessLacksOfOne) {
  const auto image = image_of({1, 1, 2, std::vector<float>{0.9F, 0.5F}});
  Scene scene = square(image, {TextureSlot::glossiness, 0, 3, 1}, kAsItIs);
  scene.materials[0].surface = Layered{.roughness = 0.25F};
  SurfacePoint point{};
  point.geometric_normal = point.shading_normal = {0, 0, 1};
  EXPECT_EQ(std::get<Layered>(surface_at(scene, scene.objects[0], 0, point).surface).roughness, 0.625F);
}

TEST(SurfaceAt, TangentsThatAMeshHasStandWhateverTheTransform) {
  const std::vector<Tangent> tangents(4, Tangent{{1, 0, 0}, 1});
  for (const Transform2& transform : {kAsItIs, Transform2{-1, 0, 1, 0, 1, 0}, Transform2{0, -1, 1, 1, 0, 0}})
    expect_near(normal_map(transform, tangents), {1, 0.5, 1}, "with tangents");
}

/// A height that equals u in the image, half as steep.
Vec3d bump_map(const Transform2& transform, std::vector<Tangent> tangents = {}) {
  std::vector<float> heights;
  for (int i = 0; i < 64; ++i) heights.push_back((static_cast<float>(i) + 0.5F) / 64);
  const auto image = image_of({64, 1, 1, heights});
  return normal_of(square(image, {TextureSlot::bump, 0, 0, 0.5F}, transform, std::move(tangents)));
}

TEST(SurfaceAt, BumpsLeanAgainstTheirSlopeWhateverTheTransform) {
  const std::vector<Tangent> odd(4, Tangent{{0.6F, 0.8F, 0}, -1});
  for (const std::vector<Tangent>& tangents : {std::vector<Tangent>{}, odd}) {
    // u = x and v = 1 - y: the normal leans against (∂h/∂x, ∂h/∂y).
    expect_near(bump_map(kAsItIs, tangents), {-0.5, 0, 1}, "h = u / 2");
    expect_near(bump_map({-1, 0, 1, 0, 1, 0}, tangents), {0.5, 0, 1}, "h = (1 - u) / 2");
    expect_near(bump_map({3, 0, -2, 0, 1, 0}, tangents), {-1.5, 0, 1}, "h = (3 u - 2) / 2");
    expect_near(bump_map({0, 1, 0, -1, 0, 0}, tangents), {0, 0.5, 1}, "h = v / 2");
    expect_near(bump_map({1, 1, -1, 0, 1, 0}, tangents), {-0.5, 0.5, 1}, "h = (u + v - 1) / 2");
    expect_near(bump_map({1, 0, 0, 1, 1, 0}, tangents), {-0.5, 0, 1}, "h = u / 2, sheared along v");
  }
}

}  // namespace
}  // namespace tessera
