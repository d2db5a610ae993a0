#pragma once

#include <array>
#include <memory>
#include <numbers>
#include <optional>

#include "core/scene/scene.h"
#include "tests/support/meshes.h"
#include "tests/support/random.h"

namespace tessera {

/// Puts scenes together in tests.
class SceneBuilder {
 public:
  std::uint32_t material(const Material& m) {
    scene_.materials.push_back(m);
    return static_cast<std::uint32_t>(scene_.materials.size() - 1);
  }
  std::uint32_t material(const WhittedSurface& surface) { return material(Material{surface}); }
  std::uint32_t texture(const Texture& t) {
    scene_.textures.push_back(t);
    return static_cast<std::uint32_t>(scene_.textures.size() - 1);
  }
  /// Takes a `Shape`, or one of its kinds.
  template <typename S>
  std::uint32_t shape(S&& s) {
    scene_.shapes.emplace_back(std::forward<S>(s));
    return static_cast<std::uint32_t>(scene_.shapes.size() - 1);
  }
  SceneBuilder& place(std::uint32_t shape, std::uint32_t material = 0, std::optional<Transform> placement = {}) {
    scene_.objects.push_back({shape, material, placement});
    return *this;
  }
  template <typename S>
  SceneBuilder& add(S&& s, std::uint32_t material = 0) {
    return place(shape(std::forward<S>(s)), material);
  }
  SceneBuilder& light(const Light& l) {
    scene_.lights.push_back(l);
    return *this;
  }
  SceneBuilder& background(Rgb c) {
    scene_.background = c;
    return *this;
  }
  std::shared_ptr<const Scene> build() {
    if (scene_.materials.empty()) scene_.materials.emplace_back();
    return std::make_shared<const Scene>(with_bounds(std::move(scene_)));
  }

 private:
  Scene scene_;
};

/// What an object sends out against `direction` where its geometric normal is `normal`.
inline Rgb emitted(const Scene& scene, std::uint32_t object, Vec3 direction, Vec3d normal) {
  const Material& material = scene.materials[scene.objects[object].material];
  return dot(to_double(direction), normal) < 0 || material.emits_both_sides ? material.emission : Rgb{};
}

inline WhittedSurface diffuse(Rgb color) { return {.diffuse = color}; }
inline WhittedSurface mirror_material() { return {.diffuse = {}, .reflect = {0.9F, 0.9F, 0.9F}}; }
inline WhittedSurface glass_material() {
  return {.diffuse = {}, .reflect = {1, 1, 1}, .transmit = {1, 1, 1}, .ior = 1.5F, .fresnel = true};
}

/// What an object is made of, as Whitted's tracer sees it. Throws unless it is one of his surfaces.
inline WhittedSurface surface_of(const Scene& scene, std::size_t object) {
  return whitted_surface(scene.materials.at(scene.objects.at(object).material).surface).value();
}

inline Transform placed(const std::array<double, 12>& rows) { return *Transform::from_rows(rows); }

/// Every shape, mirrors, glass, an instanced mesh (mirrored and squeezed too), an object that straddles the camera's
/// plane, one behind the camera, a ground, and much empty space. Seen by `mixed_camera`.
inline std::shared_ptr<const Scene> mixed_scene() {
  SceneBuilder b;
  const auto grey = b.material(diffuse({0.6F, 0.6F, 0.6F})), red = b.material(diffuse({0.8F, 0.2F, 0.1F}));
  const auto mirror = b.material(mirror_material()), glass = b.material(glass_material());
  const auto shiny =
      b.material(WhittedSurface{.diffuse = {0.1F, 0.3F, 0.6F}, .specular = {0.5F, 0.5F, 0.5F}, .shininess = 30});
  b.background({0.1F, 0.2F, 0.4F});
  b.light(PointLight{{3, 5, 4}, {60, 60, 50}})
      .light(DirectionalLight{*UnitVec3::normalize(Vec3{1, -2, -1}), {1, 1, 1}});
  b.light(AmbientLight{{0.05F, 0.05F, 0.05F}});
  b.add(Quad{{{{-4, -1, 4}, {4, -1, 4}, {4, -1, -4}, {-4, -1, -4}}}}, grey);
  b.add(Sphere{{0, 0, 0}, 1}, mirror).add(Sphere{{-1.5F, -0.4F, 1.2F}, 0.6F}, glass);
  b.add(Cone{{1.6F, -1, 0.5F}, 0.5F, {1.6F, 0.4F, 0.5F}, 0.1F}, red);
  b.add(Cylinder{{-2.4F, -1, -1}, {-2.2F, 1, -1}, 0.3F}, shiny);
  b.add(Disk{{2, 1.2F, -2}, *UnitVec3::normalize(Vec3{-1, 0.2F, 1}), 0.8F}, mirror);
  const auto ball = b.shape(icosphere(1, 0.5F));
  b.place(ball, shiny, placed({1, 0, 0, 0.9, 0, 1, 0, -0.5, 0, 0, 1, 1.6}));
  b.place(ball, red, placed({-0.5, 0.5, 0, -0.5, 0.3, 1.2, 0, 1.4, 0, 0, 0.7, -1}));
  b.place(ball, glass, placed({1, 0, 0, 0.3, 0, -1, 0, -0.6, 0, 0, 1, 2.2}));
  b.add(Quad{{{{1.2F, -1, 9}, {1.2F, 1, 9}, {1.2F, 1, 1}, {1.2F, -1, 1}}}}, red);  // beside and behind the camera
  b.add(Sphere{{0, 0, 12}, 1}, red);
  return b.build();
}

inline Camera mixed_camera() {
  return PerspectiveCamera{{{0.4F, 0.8F, 5}, {0, -0.1F, 0}, {0, 1, 0}}, static_cast<float>(std::numbers::pi / 3.5)};
}

/// One small object in a corner of much empty space.
inline std::shared_ptr<const Scene> sparse_scene() {
  SceneBuilder b;
  b.background({0.3F, 0.3F, 0.1F}).light(PointLight{{2, 3, 4}, {30, 30, 30}});
  b.material(diffuse({0.9F, 0.5F, 0.2F}));
  b.add(Sphere{{1.1F, 0.9F, 0}, 0.35F});
  return b.build();
}

inline Camera orthographic_camera() { return OrthographicCamera{{{0.5F, 1, 5}, {0, 0, 0}, {0, 1, 0}}, 4}; }

/// A random shape within `size` of the origin.
inline Shape random_shape(Random& random, double size) {
  const auto point = [&] { return to_float(random.in_cube() * size); };
  const auto radius = [&] { return static_cast<float>(size * random.magnitude(-2, -0.3)); };
  switch (random.bits() % 6) {
    case 0:
      return Sphere{point(), radius()};
    case 1:
      return Cylinder{point(), point(), radius()};
    case 2:
      return Cone{point(), radius(), point(), radius()};
    case 3:
      return Disk{point(), *UnitVec3::normalize(random.direction()), radius()};
    case 4: {
      const Vec3 corner = point(), u = point() * 0.5F, v = point() * 0.5F;
      return Quad{{corner, corner + u, corner + u + v, corner + v}};
    }
    default: {
      TriangleMesh mesh;
      for (int i = 0; i < 12; ++i) mesh.positions.push_back(point());
      for (std::uint32_t i = 0; i < 10; ++i) mesh.triangles.push_back({i, i + 1, i + 2});
      return mesh;
    }
  }
}

/// Random shapes of any kind, some of them instances, twins among them so that equal t occurs.
inline std::shared_ptr<const Scene> random_scene(std::uint64_t seed, int count, double size = 10) {
  Random random(seed);
  SceneBuilder b;
  for (int i = 0; i < count; ++i) {
    const auto shape = b.shape(random_shape(random, size));
    std::optional<Transform> placement;
    if (random.bits() % 3 == 0) {
      std::array<double, 12> rows{};
      for (double& v : rows) v = random.uniform(-1.5, 1.5);
      for (const int i3 : {3, 7, 11}) rows[static_cast<std::size_t>(i3)] *= size;
      placement = Transform::from_rows(rows);
    }
    b.place(shape, 0, placement);
    if (random.bits() % 8 == 0) b.place(shape, 0, placement);
  }
  return b.build();
}

}  // namespace tessera
