// Small shadows on large floors: what is known of a surface is known axis by axis.
#include <functional>
#include <string_view>

#include <gtest/gtest.h>

#include "core/integrator/spawn.h"
#include "tests/property/stress_scenes.h"
#include "tests/support/same_hits.h"

namespace tessera {
namespace {

/// Floors at y = 0 that reach `extent` to either side.
std::vector<std::pair<const char*, std::function<void(SceneBuilder&, float)>>> floors() {
  const auto square = [](float e) { return Quad{{{{-e, 0, e}, {e, 0, e}, {e, 0, -e}, {-e, 0, -e}}}}; };
  const auto grid = [](float e) {
    TriangleMesh mesh = grid_plane(4);
    for (Vec3& p : mesh.positions) p = {p.x * e, 0, -p.y * e};
    return mesh;
  };
  return {{"quad", [=](SceneBuilder& b, float e) { b.add(square(e)); }},
          {"mesh", [=](SceneBuilder& b, float e) { b.add(grid(e)); }},
          {"disk",
           [](SceneBuilder& b, float e) {
             b.add(Disk{{0, 0, 0}, UnitVec3::y(), e});
           }},
          {"disk off centre",
           [](SceneBuilder& b, float e) {
             b.add(Disk{{e / 2, 0, 0}, UnitVec3::y(), e});
           }},
          {"instance", [=](SceneBuilder& b, float e) {
             const double s = e;
             b.place(b.shape(grid(1)), 0, placed({s, 0, 0, 0, 0, 1, 0, 0, 0, 0, s, 0}));
           }}};
}

/// Points around the shadow of a square of a centimetre, or of what scene.schema.json promises for so large a floor:
/// dark exactly where exact arithmetic says so, but for the points whose own place isn't known well enough.
TEST(LargeFloors, KeepTheShadowsOfSmallThings) {
  const Vec3 to_sun{0.25F, 1, -0.125F};
  for (const auto& [name, add_floor] : floors())
    for (const float extent : {1e3F, 1e6F, 1e9F, 1e11F, 1e12F, 1e13F, 1e15F}) {
      const double known = double{extent} * 0x1p-48;  // what scene.schema.json promises
      for (const float height : {0.01F, 0.1F, 1.0F}) {
        const float size = std::max(0.01F, static_cast<float>(16 * known));
        SceneBuilder b;
        add_floor(b, extent);
        const float s = size / 2;
        b.add(Quad{{{{-s, height, s}, {s, height, s}, {s, height, -s}, {-s, height, -s}}}});
        const auto scene = b.build();
        const auto accel = make_accel(scene, {AccelKind::wide});
        int wrong = 0, dark = 0;
        constexpr int kAcross = 41;
        for (int i = 0; i < kAcross * kAcross; ++i) {
          // A point of the floor, seen from above beside the square.
          const double x = size * (i % kAcross - kAcross / 2) / 12.0 - height * to_sun.x,
                       z = size * (i / kAcross - kAcross / 2) / 12.0 - height * to_sun.z;
          const Vec3 eye{3 * size, height / 2, 0};
          const Ray ray{eye, to_float(Vec3d{x, 0, z} - to_double(eye))};
          const auto hit = accel->closest(ray);
          ASSERT_TRUE(hit);
          if (hit->object != 0) continue;
          // Exactly: where the float ray meets y = 0, and the way to the sun y = height.
          const double t = -double{ray.origin.y} / ray.direction.y;
          const double over_x = ray.origin.x + t * ray.direction.x + double{height} * to_sun.x,
                       over_z = ray.origin.z + t * ray.direction.z + double{height} * to_sun.z;
          const double inside = s - std::max(std::abs(over_x), std::abs(over_z));
          if (std::abs(inside) < 2 * known + 1e-6 * size) continue;
          const SurfacePoint at = world_surface(*scene, 0, hit->primitive, ray, hit->t);
          const Vec3 from = spawn_origin(at, {0, 1, 0});
          const bool hidden = accel->occluded({from, to_sun, 0, kInfinity, {0, hit->primitive}});
          dark += hidden;
          wrong += hidden != (inside > 0);
        }
        EXPECT_EQ(wrong, 0) << name << " of " << extent << ", " << size << " at " << height;
        EXPECT_GT(dark, 80) << name << " of " << extent << ", " << size << " at " << height;
      }
    }
}

/// Rays that leave such a floor don't meet it again, however they graze it, on its inner edges least of all: in every
/// structure.
TEST(LargeFloors, AreNotInTheirOwnShadow_Stress24) {
  for (const auto& [name, add_floor] : floors())
    for (const float extent : {1.0F, 1e6F, 1e12F, 1e18F}) {
      if (std::string_view(name) == "disk off centre" && extent > 1e17F) continue;
      for (const double slope : {0.0, 0.3}) {
        SceneBuilder flat;
        add_floor(flat, extent / 2);
        auto scene = std::make_shared<Scene>(*flat.build());
        if (slope != 0 && scene->objects[0].placement) continue;
        const auto tilt = [&](Vec3& p) { p.y = static_cast<float>(slope) * p.x; };
        for (Shape& shape : scene->shapes) {
          if (auto* mesh = std::get_if<TriangleMesh>(&shape); mesh && slope != 0)
            for (Vec3& p : mesh->positions) tilt(p);
          if (auto* quad = std::get_if<Quad>(&shape); quad && slope != 0)
            for (Vec3& p : quad->corners) tilt(p);
        }
        *scene = with_bounds(std::move(*scene));
        Random random(24);
        const auto brute = make_accel(scene, {AccelKind::brute});
        std::vector<KnownRay> again;
        for (int i = 0; i < 400; ++i) {
          const double near = random.magnitude(-3, 0) * extent / 2;
          Vec3d target{random.uniform(-near, near), 0, random.uniform(-near, near)};
          if (i % 4 == 0) target.x = 0;
          if (i % 4 == 1) target.z = target.x;
          target.y = slope * target.x;
          const Vec3 eye = to_float(target + Vec3d{0, near, i % 8 == 0 ? 0 : near});
          const Ray ray{eye, to_float(target - to_double(eye))};
          const auto hit = brute->closest(ray);
          if (!hit) continue;
          const SurfacePoint at = world_surface(*scene, 0, hit->primitive, ray, hit->t);
          Vec3d n = at.geometric_normal;
          if (n.y < 0) n = -n;
          const Vec3 from = spawn_origin(at, n);
          Vec3d way = random.direction();
          way = way - dot(way, n) * n;
          const Vec3 out = to_float(way + n * random.magnitude(-5, 1));
          again.push_back({{from, out, 0, kInfinity, {0, hit->primitive}}, {}});
        }
        EXPECT_GT(again.size(), 100U) << name;
        expect_same_hits_everywhere(scene, again, std::string(name) + " of " + std::to_string(extent));
      }
    }
}

}  // namespace
}  // namespace tessera
