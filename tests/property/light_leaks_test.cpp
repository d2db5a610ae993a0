// STRESS 70 and 71: smooth normals of the path tracer's surfaces, which neither leak nor darken.
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/light_images.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

constexpr double kPi = std::numbers::pi;

/// A cube with the normals of its corners; `turn` is 1 for those of outside, −1 for inward ones.
TriangleMesh smooth_cube(float half, float turn) {
  TriangleMesh mesh = smooth_box({half, half, half});
  for (Vec3& normal : mesh.normals) normal = normal * turn;
  return mesh;
}

TriangleMesh smooth_icosphere(int levels, float radius, float turn = 1) {
  TriangleMesh mesh = icosphere(levels, radius);
  for (const Vec3 p : mesh.positions) mesh.normals.push_back(p * turn);
  return mesh;
}

/// Every light there is, outside of what reaches no farther than 2.
void light_from_outside(SceneBuilder& b) {
  b.light(EnvironmentLight{.radiance = {3, 3, 3}, .map = nullptr});
  b.light(PointLight{{2.01F, 0.3F, 0.2F}, {9, 9, 9}}).light(PointLight{{3, -4, 5}, {99, 99, 99}});
  b.light(SunLight{*UnitVec3::normalize(Vec3{-1, 0.2F, -0.3F}), {9, 9, 9}, 0.3F});
  b.light(DirectionalLight{*UnitVec3::normalize(Vec3{0.1F, 1, -0.2F}), {9, 9, 9}});
  b.light(SpotLight{{0, 0, -4}, UnitVec3::z(), {99, 99, 99}, 0.5F, 0.7F});
  const auto lamp = b.material(Material{.surface = Diffuse{{}}, .emission = {9, 9, 9}, .emits_both_sides = true});
  b.add(horizontal(3, 2.001F), lamp).add(Sphere{{-4, 0, 0}, 1.9F}, lamp);
}

/// Rough and smooth; with transmission none.
std::vector<Surface> opaque_surfaces() {
  return {Diffuse{{1, 1, 1}}, Conductor{grey(0.2F), grey(4), 0}, Conductor{grey(0.2F), grey(4), 0.6F},
          MetallicRoughness{{1, 1, 1}, 0, 0.3F},
          WhittedSurface{.diffuse = grey(0.5F), .specular = grey(0.5F), .shininess = 4, .reflect = grey(0.5F)}};
}

TEST(LightLeaks, ClosedMeshesAreBlackInside_Stress70) {
  for (const Surface& surface : opaque_surfaces())
    for (const float turn : {1.0F, -1.0F})
      for (const int kind : {0, 1, 2, 3}) {
        SceneBuilder b;
        b.material(Material{.surface = surface});
        const auto inner = b.shape(smooth_icosphere(1, 0.7F, turn));
        if (kind == 0) b.add(smooth_cube(2, turn));
        if (kind == 1) b.add(smooth_icosphere(0, 2, turn));
        if (kind == 2) b.add(smooth_icosphere(2, 2, turn));
        if (kind == 3)
          b.place(b.shape(smooth_icosphere(1, 1, turn)), 0, placed({1.9, 0.2, 0, 0, 0, -1.2, 0.3, 0, 0, 0, 1.5, 0.1}));
        light_from_outside(b);
        // Bodies that touch the walls, or go through them by a hair.
        b.place(inner, 0, placed({1, 0, 0, 0.6, 0, 1, 0, 0, 0, 0, 1, 0}));
        b.place(inner, 0, placed({0.9, 0, 0, 0, 0, 0.9, 0, 0, 0, 0, 0.9, -0.7}));
        const auto scene = b.build();
        for (const IntegratorKind integrator : {IntegratorKind::path, IntegratorKind::direct}) {
          Settings settings = light_settings(integrator, 20, static_cast<std::uint32_t>(effort(2, 256)), 12);
          const Extremes seen = extremes_of(
              render_image(scene, PerspectiveCamera{{{-0.4F, -0.3F, 0.3F}, {0.6F, 0.1F, -0.1F}, {0, 0, 1}}, 2.4F},
                           settings)
                  .pixels);
          ASSERT_EQ(seen.least, 0);
          ASSERT_EQ(seen.most, 0) << "surface " << surface.index() << ", normals " << turn << ", mesh " << kind;
        }
      }
}

/// Smooth bodies of few triangles that go a hair through three walls: what lies between their faces and the surface
/// that their normals stand for is outside.
TEST(LightLeaks, BodiesThroughTheWallsBringNoLightIn_Stress70) {
  for (const Surface& surface : opaque_surfaces()) {
    SceneBuilder b;
    b.material(Material{.surface = surface});
    b.add(smooth_cube(2, -1));
    light_from_outside(b);
    for (const float s : {1.0F, -1.0F}) {
      TriangleMesh ball = smooth_ball(8, 6);
      for (Vec3& p : ball.positions) p = p + Vec3{1.0001F, 1.0001F * s, -1.0001F};
      b.add(ball);
    }
    const auto scene = b.build();
    for (const Vec3 at : {Vec3{0.1F, 0.2F, -0.1F}, Vec3{1, 1, -1}, Vec3{1.2F, -1.2F, 0.4F}}) {
      const Settings settings = light_settings(IntegratorKind::path, 64, static_cast<std::uint32_t>(effort(1, 64)), 8);
      ASSERT_EQ(
          extremes_of(
              render_image(scene, PerspectiveCamera{{{-1.9F, -1.9F, 1.95F}, at, {0, 0, 1}}, 1.8F}, settings).pixels)
              .most,
          0)
          << "surface " << surface.index();
    }
  }
}

const OrthographicCamera kFromFront{{{0, -5, 0}, {0, 0, 0}, {0, 0, 1}}, 2.2F};

/// The root of the mean square by which a ball of triangles differs from the sphere; without its rim, which a coarse
/// ball doesn't reach.
double off_the_sphere(const Shape& ball, bool area_light, std::uint32_t samples) {
  const auto image = [&](const Shape& shape) {
    SceneBuilder b;
    b.material(Material{.surface = Diffuse{grey(0.8F)}});
    const auto lamp = b.material(Material{.surface = Diffuse{{}}, .emission = {9, 9, 9}});
    b.add(shape);
    if (area_light)
      b.add(Sphere{{3, -1.5F, 2}, 0.5F}, lamp);
    else
      b.light(PointLight{{3, -1.5F, 2}, {9, 9, 9}});
    Settings settings = light_settings(IntegratorKind::direct, 64, samples);
    settings.jitter = false;
    return render_image(b.build(), kFromFront, settings).pixels;
  };
  const Pixels sphere = image(Sphere{{0, 0, 0}, 1}), mesh = image(ball);
  double squares = 0;
  int count = 0;
  for (std::uint32_t y = 0; y < 64; ++y)
    for (std::uint32_t x = 0; x < 64; ++x) {
      if (std::hypot(x - 31.5, y - 31.5) > 22) continue;
      const double off = double{mesh.color[y * 64 + x].g} - sphere.color[y * 64 + x].g;
      squares += off * off;
      ++count;
    }
  return std::sqrt(squares / count);
}

TEST(LightLeaks, BallsConvergeToTheSphere_Stress71) {
  for (const bool area_light : {false, true}) {
    const auto samples = static_cast<std::uint32_t>(area_light ? effort(32, 1024) : 1);
    double before = kInfinity;
    for (const std::uint32_t fine : {6U, 12U, 24U, 48U}) {
      const double off = off_the_sphere(smooth_ball(fine * 2, fine), area_light, samples);
      EXPECT_LT(off, area_light ? 0.8 * before : 0.6 * before)
          << fine << (area_light ? ", area light" : ", point light");
      before = off;
    }
    EXPECT_LT(before, area_light ? 0.02 : 0.01);
  }
}

/// Each triangle with corners of its own and the normals of its face, or with none.
TriangleMesh faceted(const TriangleMesh& mesh, float normals) {
  TriangleMesh out;
  for (const TriangleIndices& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(out.positions.size());
    for (const std::uint32_t vertex : t) out.positions.push_back(mesh.positions[vertex]);
    const Vec3d a = to_double(out.positions[first]);
    const Vec3 normal =
        *UnitVec3::normalize(cross(to_double(out.positions[first + 1]) - a, to_double(out.positions[first + 2]) - a));
    out.triangles.push_back({first, first + 1, first + 2});
    if (normals != 0) out.normals.insert(out.normals.end(), 3, normal * normals);
  }
  return out;
}

TEST(LightLeaks, FlatNormalsChangeNothing_Stress71) {
  for (Surface surface : {Surface(Diffuse{grey(0.8F)}), Surface(Dielectric{1.5F, 0.4F}), Surface(Dielectric{1.4F}),
                          Surface(Conductor{grey(0.2F), grey(3), 0.2F})}) {
    const auto image = [&](float normals) {
      SceneBuilder b;
      b.material(Material{.surface = surface});
      b.add(faceted(smooth_ball(12, 8), normals)).background({0.3F, 0.4F, 0.5F});
      b.light(PointLight{{-2, -2, 1}, {3, 3, 3}})
          .light(SunLight{*UnitVec3::normalize(Vec3{-1, 1, -0.3F}), {1, 1, 1}, 0.4F});
      return render_image(b.build(), kFromFront, light_settings(IntegratorKind::path, 40, 4)).pixels;
    };
    for (const float normals : {1.0F, 0.3F, -1.0F}) {
      EXPECT_TRUE(same_bytes(image(0), image(normals))) << surface.index() << ", " << normals;
    }
  }
}

}  // namespace
}  // namespace tessera
