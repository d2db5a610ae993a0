#include <cmath>
#include <new>
#include <numbers>
#include <stdexcept>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "proto/parse.h"
#include "tests/support/scenes.h"
#include "tests/unit/proto/test_files.h"

namespace tessera::proto {
namespace {

Scene parsed(std::string_view text) {
  const auto result = parse_scene(text, NoFiles(), Limits());
  if (!result) {
    ADD_FAILURE() << result.problem().detail << result.problem().errors.at(0).pointer << " "
                  << result.problem().errors.at(0).detail;
    return {};
  }
  return *result->scene;
}

TEST(ParseScene, AnEmptySceneHasNothing) {
  const Scene scene = parsed(R"({"objects": []})");
  EXPECT_TRUE(scene.shapes.empty());
  EXPECT_TRUE(scene.objects.empty());
  EXPECT_TRUE(scene.materials.empty());
  EXPECT_TRUE(scene.lights.empty());
  EXPECT_EQ(scene.background, Rgb{});
  EXPECT_FALSE(scene.camera);
  EXPECT_TRUE(scene.warnings.empty());
}

TEST(ParseScene, EveryInlineShape) {
  const Scene scene = parsed(R"({"background": [0.25, 0.5, 1], "objects": [
    {"type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [0, 1.5, -2e-1]], "triangles": [[0, 1, 2]],
     "normals": [[0, 0, 1], [0, 0, 2], [0, 1, 0]]},
    {"type": "sphere", "center": [1, 2, 3], "radius": 4},
    {"type": "cylinder", "base": [1, 2, 3], "apex": [4, 5, 6], "radius": 7},
    {"type": "cone", "base": [1, 2, 3], "base_radius": 4, "apex": [5, 6, 7], "apex_radius": 8},
    {"type": "disk", "center": [1, 2, 3], "normal": [0, -5, 0], "radius": 4},
    {"type": "quad", "corners": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]}]})");
  EXPECT_EQ(scene.background, (Rgb{0.25F, 0.5F, 1}));
  ASSERT_EQ(scene.shapes.size(), 6U);
  const auto& mesh = std::get<TriangleMesh>(scene.shapes[0]);
  EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1.5F, -0.2F}}));
  EXPECT_EQ(mesh.triangles, (std::vector<TriangleIndices>{{0, 1, 2}}));
  EXPECT_EQ(mesh.normals, (std::vector<Vec3>{{0, 0, 1}, {0, 0, 2}, {0, 1, 0}}));
  const auto& sphere = std::get<Sphere>(scene.shapes[1]);
  EXPECT_EQ(sphere.center, (Vec3{1, 2, 3}));
  EXPECT_EQ(sphere.radius, 4);
  const auto& cylinder = std::get<Cylinder>(scene.shapes[2]);
  EXPECT_EQ(cylinder.base, (Vec3{1, 2, 3}));
  EXPECT_EQ(cylinder.apex, (Vec3{4, 5, 6}));
  EXPECT_EQ(cylinder.radius, 7);
  const auto& cone = std::get<Cone>(scene.shapes[3]);
  EXPECT_EQ(cone.base, (Vec3{1, 2, 3}));
  EXPECT_EQ(cone.base_radius, 4);
  EXPECT_EQ(cone.apex, (Vec3{5, 6, 7}));
  EXPECT_EQ(cone.apex_radius, 8);
  const auto& disk = std::get<Disk>(scene.shapes[4]);
  EXPECT_EQ(disk.center, (Vec3{1, 2, 3}));
  EXPECT_EQ(disk.normal.vec(), (Vec3{0, -1, 0}));
  EXPECT_EQ(disk.radius, 4);
  EXPECT_EQ(std::get<Quad>(scene.shapes[5]).corners[2], (Vec3{1, 1, 0}));
  ASSERT_EQ(scene.objects.size(), 6U);
  for (std::uint32_t i = 0; i < 6; ++i) {
    EXPECT_EQ(scene.objects[i].shape, i);
    EXPECT_FALSE(scene.objects[i].placement);
  }
}

TEST(ParseScene, ObjectsWithoutAMaterialAreGrey) {
  const Scene scene = parsed(R"({"materials": {"red": {"type": "diffuse", "color": [1, 0, 0]}}, "objects": [
    {"type": "sphere", "center": [0, 0, 0], "radius": 1},
    {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "red"},
    {"type": "sphere", "center": [0, 0, 0], "radius": 1}]})");
  ASSERT_EQ(scene.materials.size(), 2U);
  EXPECT_EQ(surface_of(scene, 0).diffuse, (Rgb{0.5F, 0.5F, 0.5F}));
  EXPECT_EQ(surface_of(scene, 1).diffuse, (Rgb{1, 0, 0}));
  EXPECT_EQ(scene.objects[0].material, scene.objects[2].material);
}

TEST(ParseScene, EveryMaterialInTheOrderOfNames) {
  const Scene scene = parsed(R"({"materials": {
    "e": {"type": "whitted", "diffuse": [0.125, 0.25, 0.5], "specular": [1, 0, 0], "shininess": 3,
          "reflect": [0, 1, 0], "transmit": [0, 0, 1], "ior": 1.5, "fresnel": true},
    "d": {"type": "dielectric", "ior": 1.5, "color": [0, 1, 0]},
    "c": {"type": "mirror", "color": [0.5, 1, 1]},
    "b": {"type": "phong", "diffuse": [0.5, 0, 0], "specular": [1, 1, 1], "shininess": 20},
    "a": {"type": "diffuse", "color": [0.25, 0.5, 0.75]},
    "f": {"type": "whitted"}}, "objects": []})");
  ASSERT_EQ(scene.materials.size(), 6U);
  const auto expect = [&](std::size_t i, const WhittedSurface& m) {
    const WhittedSurface found = whitted_surface(scene.materials[i].surface).value();
    EXPECT_EQ(found.diffuse, m.diffuse) << i;
    EXPECT_EQ(found.specular, m.specular) << i;
    EXPECT_EQ(found.shininess, m.shininess) << i;
    EXPECT_EQ(found.reflect, m.reflect) << i;
    EXPECT_EQ(found.transmit, m.transmit) << i;
    EXPECT_EQ(found.ior, m.ior) << i;
    EXPECT_EQ(found.fresnel, m.fresnel) << i;
  };
  const Rgb black{}, white{1, 1, 1};
  expect(0, {{0.25F, 0.5F, 0.75F}, black, 1, black, black, 1, false});
  expect(1, {{0.5F, 0, 0}, white, 20, black, black, 1, false});
  expect(2, {black, black, 1, {0.5F, 1, 1}, black, 1, false});
  expect(3, {black, black, 1, white, {0, 1, 0}, 1.5F, true});
  expect(4, {{0.125F, 0.25F, 0.5F}, {1, 0, 0}, 3, {0, 1, 0}, {0, 0, 1}, 1.5F, true});
  expect(5, WhittedSurface{});
}

template <typename T>
T surface_named(const Scene& scene, std::size_t i) {
  return std::get<T>(scene.materials.at(i).surface);
}

TEST(ParseScene, PhysicalMaterials) {
  const Scene scene = parsed(R"({"materials": {
    "a": {"type": "dielectric", "ior": 1.25},
    "b": {"type": "dielectric", "ior": 0.001, "roughness": 1, "color": [0, 0.5, 1]},
    "c": {"type": "conductor", "eta": [0.25, 0.5, 1], "k": [4, 2, 0], "roughness": 0.5},
    "d": {"type": "conductor", "color": [0.25, 0, 0.64]},
    "e": {"type": "conductor", "color": [1, 1, 1]},
    "f": {"type": "metallic_roughness"},
    "g": {"type": "metallic_roughness", "base_color": [0.25, 0.5, 1], "metallic": 0, "roughness": 0.75}}, "objects": []})");
  EXPECT_EQ(surface_named<Dielectric>(scene, 0).ior, 1.25F);
  EXPECT_EQ(surface_named<Dielectric>(scene, 0).roughness, 0);
  EXPECT_EQ(surface_named<Dielectric>(scene, 0).color, (Rgb{1, 1, 1}));
  EXPECT_EQ(surface_named<Dielectric>(scene, 1).ior, 0.001F);
  EXPECT_EQ(surface_named<Dielectric>(scene, 1).roughness, 1);
  EXPECT_EQ(surface_named<Dielectric>(scene, 1).color, (Rgb{0, 0.5F, 1}));
  EXPECT_EQ(surface_named<Conductor>(scene, 2).eta, (Rgb{0.25F, 0.5F, 1}));
  EXPECT_EQ(surface_named<Conductor>(scene, 2).k, (Rgb{4, 2, 0}));
  EXPECT_EQ(surface_named<Conductor>(scene, 2).roughness, 0.5F);
  // With eta 1, k = 2·sqrt(r / (1 − r)) reflects r at normal incidence: k² / (4 + k²).
  const auto tinted = surface_named<Conductor>(scene, 3);
  EXPECT_EQ(tinted.eta, (Rgb{1, 1, 1}));
  EXPECT_NEAR(tinted.k.r, 1.1547005, 1e-6);
  EXPECT_EQ(tinted.k.g, 0);
  EXPECT_NEAR(tinted.k.b, 2.6666667, 1e-6);
  const double k = surface_named<Conductor>(scene, 4).k.g;
  EXPECT_NEAR(k * k / (4 + k * k), 0.9999, 1e-6) << "the whole needs an infinite k";
  EXPECT_EQ(surface_named<MetallicRoughness>(scene, 5).base_color, (Rgb{1, 1, 1})) << "glTF's defaults";
  EXPECT_EQ(surface_named<MetallicRoughness>(scene, 5).metallic, 1);
  EXPECT_EQ(surface_named<MetallicRoughness>(scene, 5).roughness, 1);
  EXPECT_EQ(surface_named<MetallicRoughness>(scene, 6).base_color, (Rgb{0.25F, 0.5F, 1}));
  EXPECT_EQ(surface_named<MetallicRoughness>(scene, 6).metallic, 0);
  EXPECT_EQ(surface_named<MetallicRoughness>(scene, 6).roughness, 0.75F);
}

// What metals reflect at normal incidence, as tables of measurements have it for red, green and blue light.
TEST(ParseScene, MetalsByName) {
  const auto reflectance = [](float eta, float k) {
    return ((eta - 1) * (eta - 1) + k * k) / ((eta + 1) * (eta + 1) + k * k);
  };
  const auto expect = [&](const std::string& metal, Rgb expected) {
    const Scene scene =
        parsed(R"({"objects": [], "materials": {"m": {"type": "conductor", "metal": ")" + metal + R"("}}})");
    const auto surface = surface_named<Conductor>(scene, 0);
    EXPECT_NEAR(reflectance(surface.eta.r, surface.k.r), expected.r, 0.05) << metal;
    EXPECT_NEAR(reflectance(surface.eta.g, surface.k.g), expected.g, 0.05) << metal;
    EXPECT_NEAR(reflectance(surface.eta.b, surface.k.b), expected.b, 0.07) << metal;
  };
  expect("aluminium", {0.91F, 0.92F, 0.92F});
  expect("chromium", {0.64F, 0.64F, 0.69F});
  expect("copper", {0.95F, 0.64F, 0.54F});
  expect("gold", {0.97F, 0.77F, 0.35F});
  expect("silver", {0.97F, 0.96F, 0.92F});
}

TEST(ParseScene, AnyMaterialEmitsAndHasAnAlpha) {
  for (const char* surface :
       {R"("type": "diffuse", "color": [0, 0, 0])", R"("type": "mirror", "color": [1, 1, 1])",
        R"("type": "phong", "diffuse": [0, 0, 0], "specular": [0, 0, 0], "shininess": 1)", R"("type": "whitted")",
        R"("type": "dielectric", "ior": 1.5)", R"("type": "conductor", "metal": "gold")",
        R"("type": "metallic_roughness")", R"("type": "metallic_roughness", "clearcoat": 1)",
        R"("type": "unlit", "color": [1, 1, 1])"}) {
    const auto material = [&](const std::string& rest) {
      return parsed(R"({"objects": [], "materials": {"m": {)" + std::string(surface) + rest + "}}}").materials.at(0);
    };
    EXPECT_TRUE(material("").emission.is_black()) << surface;
    EXPECT_FALSE(material("").emits_both_sides) << surface;
    EXPECT_EQ(material("").alpha, 1) << surface;
    EXPECT_EQ(material(R"(, "emission": [1, 2, 300])").emission, (Rgb{1, 2, 300})) << surface;
    EXPECT_FALSE(material(R"(, "emission": [1, 2, 3], "emits": "front")").emits_both_sides) << surface;
    EXPECT_TRUE(material(R"(, "emission": [1, 2, 3], "emits": "both")").emits_both_sides) << surface;
    EXPECT_EQ(material(R"(, "alpha": 0.25)").alpha, 0.25F) << surface;
    EXPECT_EQ(material(R"(, "alpha": 0)").alpha, 0) << surface;
  }
}

TEST(ParseScene, MetallicRoughnessWithLayers) {
  const auto material = [](const std::string& fields) {
    return parsed(R"({"objects": [], "materials": {"m": {"type": "metallic_roughness")" + fields + "}}}")
        .materials.at(0);
  };
  const auto layers = [&](const std::string& fields) { return std::get<Layered>(material(fields).surface); };
  const Layered none = layers(R"(, "ior": 1.5)");
  EXPECT_EQ(none.base_color, (Rgb{1, 1, 1})) << "the defaults are glTF's";
  EXPECT_EQ(none.metallic, 1);
  EXPECT_EQ(none.roughness, 1);
  EXPECT_EQ(none.specular, 1);
  EXPECT_EQ(none.specular_color, (Rgb{1, 1, 1}));
  EXPECT_EQ(none.transmission, 0);
  EXPECT_TRUE(none.thin);
  EXPECT_EQ(none.clearcoat, 0);
  EXPECT_EQ(none.clearcoat_roughness, 0);
  EXPECT_TRUE(none.sheen_color.is_black());
  EXPECT_EQ(none.sheen_roughness, 0);
  const Material all = material(R"(, "base_color": [0.25, 0.5, 1], "metallic": 0.125, "roughness": 0.5, "ior": 2,
      "specular": 0.25, "specular_color": [1, 2, 3], "transmission": 0.75, "thin": false, "absorption": [4, 5, 6],
      "clearcoat": 0.5, "clearcoat_roughness": 0.125, "sheen_color": [0.5, 0.25, 0], "sheen_roughness": 0.625)");
  const auto& s = std::get<Layered>(all.surface);
  EXPECT_EQ(s.base_color, (Rgb{0.25F, 0.5F, 1}));
  EXPECT_EQ(s.metallic, 0.125F);
  EXPECT_EQ(s.roughness, 0.5F);
  EXPECT_EQ(s.ior, 2);
  EXPECT_EQ(s.specular, 0.25F);
  EXPECT_EQ(s.specular_color, (Rgb{1, 2, 3}));
  EXPECT_EQ(s.transmission, 0.75F);
  EXPECT_FALSE(s.thin);
  EXPECT_EQ(all.absorption, (Rgb{4, 5, 6}));
  EXPECT_EQ(s.clearcoat, 0.5F);
  EXPECT_EQ(s.clearcoat_roughness, 0.125F);
  EXPECT_EQ(s.sheen_color, (Rgb{0.5F, 0.25F, 0}));
  EXPECT_EQ(s.sheen_roughness, 0.625F);
  // Any one of them is enough.
  for (const char* one : {R"("specular": 1)", R"("specular_color": [1, 1, 1])", R"("transmission": 0)",
                          R"("clearcoat": 0)", R"("sheen_color": [0, 0, 0])"})
    layers(std::string(", ") + one);
}

TEST(ParseScene, UnlitMaterialsAndWhatAbsorbs) {
  const Scene scene = parsed(R"({"objects": [], "materials": {
    "a": {"type": "unlit", "color": [0.25, 0.5, 7]},
    "b": {"type": "dielectric", "ior": 1.5, "absorption": [1, 2, 3]},
    "c": {"type": "whitted", "transmit": [1, 1, 1], "absorption": [1, 2, 3]}}})");
  EXPECT_EQ(surface_named<Unlit>(scene, 0).color, (Rgb{0.25F, 0.5F, 7}));
  EXPECT_TRUE(scene.materials.at(0).absorption.is_black());
  EXPECT_EQ(scene.materials.at(1).absorption, (Rgb{1, 2, 3}));
  EXPECT_EQ(scene.materials.at(2).absorption, (Rgb{1, 2, 3}));
}

TEST(ParseScene, SpotsSunsAndAnEnvironment) {
  const Scene scene = parsed(R"({"objects": [], "lights": [
    {"type": "spot", "position": [1, 2, 3], "direction": [0, -2, 0], "intensity": [4, 5, 6], "inner_angle": 30,
     "outer_angle": 45},
    {"type": "spot", "position": [1, 2, 3], "direction": [0, -2, 0], "intensity": [4, 5, 6], "outer_angle": 90},
    {"type": "sun", "direction": [0, -3, 4], "irradiance": [1, 2, 3], "angle": 2},
    {"type": "sun", "direction": [0, -3, 4], "irradiance": [1, 2, 3]},
    {"type": "environment"}]})");
  ASSERT_EQ(scene.lights.size(), 5U);
  const auto& spot = std::get<SpotLight>(scene.lights[0]);
  EXPECT_EQ(spot.position, (Vec3{1, 2, 3}));
  EXPECT_EQ(spot.direction.vec(), (Vec3{0, -1, 0}));
  EXPECT_EQ(spot.intensity, (Rgb{4, 5, 6}));
  EXPECT_FLOAT_EQ(spot.inner_angle, static_cast<float>(std::numbers::pi / 6));
  EXPECT_FLOAT_EQ(spot.outer_angle, static_cast<float>(std::numbers::pi / 4));
  EXPECT_EQ(std::get<SpotLight>(scene.lights[1]).inner_angle, 0);
  EXPECT_FLOAT_EQ(std::get<SpotLight>(scene.lights[1]).outer_angle, static_cast<float>(std::numbers::pi / 2));
  const auto& sun = std::get<SunLight>(scene.lights[2]);
  EXPECT_EQ(sun.direction.vec(), (Vec3{0, -0.6F, 0.8F}));
  EXPECT_EQ(sun.irradiance, (Rgb{1, 2, 3}));
  EXPECT_FLOAT_EQ(sun.angle, static_cast<float>(std::numbers::pi / 90));
  EXPECT_FLOAT_EQ(std::get<SunLight>(scene.lights[3]).angle, static_cast<float>(0.53 * std::numbers::pi / 180));
  const auto& sky = std::get<EnvironmentLight>(scene.lights[4]);
  EXPECT_EQ(sky.radiance, (Rgb{1, 1, 1}));
  EXPECT_FALSE(sky.map);
}

TEST(ParseScene, EveryLight) {
  const Scene scene = parsed(R"({"objects": [], "lights": [
    {"type": "point", "position": [1, 2, 3], "intensity": [4, 5, 6]},
    {"type": "point", "position": [1, 2, 3], "intensity": [4, 5, 6], "falloff": "none"},
    {"type": "directional", "direction": [0, -3, 4], "irradiance": [1, 2, 3]},
    {"type": "ambient", "radiance": [0.5, 0.25, 0]}]})");
  ASSERT_EQ(scene.lights.size(), 4U);
  const auto& point = std::get<PointLight>(scene.lights[0]);
  EXPECT_EQ(point.position, (Vec3{1, 2, 3}));
  EXPECT_EQ(point.intensity, (Rgb{4, 5, 6}));
  EXPECT_TRUE(point.falls_off);
  EXPECT_FALSE(std::get<PointLight>(scene.lights[1]).falls_off);
  const auto& directional = std::get<DirectionalLight>(scene.lights[2]);
  EXPECT_EQ(directional.direction.vec(), (Vec3{0, -0.6F, 0.8F}));
  EXPECT_EQ(directional.irradiance, (Rgb{1, 2, 3}));
  EXPECT_EQ(std::get<AmbientLight>(scene.lights[3]).radiance, (Rgb{0.5F, 0.25F, 0}));
}

TEST(ParseScene, Cameras) {
  const Scene perspective = parsed(
      R"({"objects": [], "camera": {"type": "perspective", "from": [1, 2, 3], "at": [0, 0, 0], "up": [0, 0, 1],
          "fov": 90}})");
  const auto& pinhole = std::get<PerspectiveCamera>(perspective.camera.value());
  EXPECT_EQ(pinhole.view.from, (Vec3{1, 2, 3}));
  EXPECT_EQ(pinhole.view.at, (Vec3{}));
  EXPECT_EQ(pinhole.view.up, (Vec3{0, 0, 1}));
  EXPECT_FLOAT_EQ(pinhole.vertical_fov, static_cast<float>(std::numbers::pi / 2));

  const Scene defaults = parsed(R"({"objects": [], "camera": {"type": "perspective", "from": [1, 2, 3],
                                    "at": [0, 0, 0]}})");
  const auto& plain = std::get<PerspectiveCamera>(defaults.camera.value());
  EXPECT_EQ(plain.view.up, (Vec3{0, 1, 0}));
  EXPECT_FLOAT_EQ(plain.vertical_fov, static_cast<float>(std::numbers::pi / 4));

  const Scene orthographic = parsed(R"({"objects": [], "camera": {"type": "orthographic", "from": [1, 2, 3],
                                        "at": [0, 0, 0], "height": 2.5}})");
  EXPECT_EQ(std::get<OrthographicCamera>(orthographic.camera.value()).height, 2.5F);
  EXPECT_EQ(std::get<OrthographicCamera>(orthographic.camera.value()).view.from, (Vec3{1, 2, 3}));
}

TEST(ParseScene, CamerasWithALensIntrinsicsAndClipping) {
  const auto camera = [](const std::string& rest) {
    const Scene scene =
        parsed(R"({"objects": [], "camera": {"type": "perspective", "from": [0, 0, 5], "at": [0, 0, 0])" + rest + "}}");
    return std::get<PerspectiveCamera>(scene.camera.value());
  };
  EXPECT_EQ(camera("").lens.radius, 0);
  EXPECT_FALSE(camera("").intrinsics);
  EXPECT_EQ(camera("").clipping.near, 0);
  EXPECT_EQ(camera("").clipping.far, kInfinity);
  const auto lens = camera(R"(, "lens": {"radius": 0.25, "focus_distance": 4})").lens;
  EXPECT_EQ(lens.radius, 0.25F);
  EXPECT_EQ(lens.focus_distance, 4);
  const auto intrinsics = camera(R"(, "intrinsics": {"fx": 500, "fy": 250, "cx": 320.5, "cy": -1})").intrinsics;
  ASSERT_TRUE(intrinsics);
  EXPECT_EQ(intrinsics->fx, 500);
  EXPECT_EQ(intrinsics->fy, 250);
  EXPECT_EQ(intrinsics->cx, 320.5F);
  EXPECT_EQ(intrinsics->cy, -1);
  EXPECT_EQ(camera(R"(, "near": 1, "far": 1.5)").clipping.near, 1);
  EXPECT_EQ(camera(R"(, "near": 1, "far": 1.5)").clipping.far, 1.5F);
  EXPECT_EQ(camera(R"(, "near": 1)").clipping.far, kInfinity);
  const Scene parallel = parsed(R"({"objects": [], "camera": {"type": "orthographic", "from": [1, 2, 3],
                                    "at": [0, 0, 0], "height": 2.5, "near": 0.5, "far": 10}})");
  EXPECT_EQ(std::get<OrthographicCamera>(parallel.camera.value()).clipping.near, 0.5F);
  EXPECT_EQ(std::get<OrthographicCamera>(parallel.camera.value()).clipping.far, 10);
}

TEST(ParseScene, CamerasWithoutAPlace) {
  const Scene given = parsed(R"({"objects": [], "camera": {"type": "perspective", "direction": [0, 0, -2],
                                 "up": [1, 0, 0], "fov": 90}})");
  const auto& pinhole = std::get<PerspectiveCamera>(given.camera.value());
  EXPECT_FALSE(pinhole.view.is_placed);
  EXPECT_EQ(pinhole.view.at - pinhole.view.from, (Vec3{0, 0, -1}));
  EXPECT_EQ(pinhole.view.up, (Vec3{1, 0, 0}));
  EXPECT_FLOAT_EQ(pinhole.vertical_fov, static_cast<float>(std::numbers::pi / 2));

  const Scene bare = parsed(R"({"objects": [], "camera": {"type": "orthographic"}})");
  const View view = std::get<OrthographicCamera>(bare.camera.value()).view;
  EXPECT_FALSE(view.is_placed);
  EXPECT_LT(length(cross(view.at - view.from, kUnplacedView.at - kUnplacedView.from)), 1e-6F);
}

TEST(ParseScene, CamerasLookFromAnAngle) {
  const auto view = [](const std::string& rest) {
    const Scene scene = parsed(R"({"objects": [], "camera": {"type": "perspective", )" + rest + "}}");
    return std::get<PerspectiveCamera>(scene.camera.value()).view;
  };
  const auto expect_along = [](const View& seen, Vec3 way) {
    EXPECT_FALSE(seen.is_placed);
    EXPECT_LT(length(seen.at - seen.from - way), 1e-6F) << way.x << ' ' << way.y << ' ' << way.z;
  };
  const float half = std::sqrt(0.5F);
  expect_along(view(R"("azimuth": 0, "elevation": 0)"), {0, 0, -1});
  expect_along(view(R"("azimuth": 90, "elevation": 0)"), {-1, 0, 0});
  expect_along(view(R"("azimuth": -90, "elevation": 0)"), {1, 0, 0});
  expect_along(view(R"("azimuth": 180, "elevation": 45)"), {0, -half, half});
  expect_along(view(R"("azimuth": 0, "elevation": 90)"), {0, -1, 0});
  expect_along(view(R"("elevation": 0)"), {-0.5F, 0, -std::sqrt(0.75F)});
  EXPECT_EQ(view(R"("azimuth": 5)").at, view(R"("azimuth": 5, "elevation": 20)").at);
  EXPECT_LT(length(view(R"("azimuth": 90, "elevation": 90)").up - Vec3{-1, 0, 0}), 1e-6F);
  EXPECT_LT(length(view(R"("azimuth": 90, "elevation": -90)").up - Vec3{1, 0, 0}), 1e-6F);
  EXPECT_EQ(view(R"("elevation": -90, "up": [0, 0, 1])").up, (Vec3{0, 0, 1}));
}

TEST(ParseScene, InstancesShareTheirShape) {
  const Scene scene = parsed(R"({"lights": [{"type": "ambient", "radiance": [1, 1, 1]}],
    "geometries": {"ball": {"type": "sphere", "center": [0, 0, 0], "radius": 1}},
    "objects": [{"type": "instance", "of": "ball"}, {"type": "instance", "of": "ball", "transform": {"scale": 2}}]})");
  ASSERT_EQ(scene.shapes.size(), 1U);
  ASSERT_EQ(scene.objects.size(), 2U);
  EXPECT_EQ(scene.objects[0].shape, 0U);
  EXPECT_FALSE(scene.objects[0].placement);
  EXPECT_EQ(scene.objects[1].shape, 0U);
  EXPECT_TRUE(scene.objects[1].placement);
  EXPECT_TRUE(scene.warnings.empty());
}

TEST(ParseScene, GeometryThatNobodyPlacesIsLeftOutAndReported) {
  const Scene scene = parsed(R"({"lights": [{"type": "ambient", "radiance": [1, 1, 1]}],
    "geometries": {"ball": {"type": "sphere", "center": [0, 0, 0], "radius": 1},
      "a/b": {"type": "sphere", "center": [5, 0, 0], "radius": 2},
      "c": {"type": "sphere", "center": [6, 0, 0], "radius": 3}},
    "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 7}, {"type": "instance", "of": "c"}]})");
  ASSERT_EQ(scene.shapes.size(), 2U);
  EXPECT_EQ(std::get<Sphere>(scene.shapes[scene.objects[0].shape]).radius, 7);
  EXPECT_EQ(std::get<Sphere>(scene.shapes[scene.objects[1].shape]).radius, 3);
  EXPECT_EQ(local_bounds(scene)[scene.objects[0].shape].hi, bounds(Sphere{{0, 0, 0}, 7}).hi);
  EXPECT_EQ(local_bounds(scene)[scene.objects[1].shape].hi, bounds(Sphere{{6, 0, 0}, 3}).hi);
  ASSERT_EQ(scene.warnings.size(), 2U);
  EXPECT_EQ(scene.warnings[0].pointer, "/geometries/a~1b");
  EXPECT_EQ(scene.warnings[1].pointer, "/geometries/ball");
}

/// Where a transform takes a point.
Vec3 placed(const std::string& transform, Vec3d point) {
  const Scene scene =
      parsed(R"({"objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "transform": )" + transform + "}]}");
  if (scene.objects.empty() || !scene.objects[0].placement) return {};
  return to_float(scene.objects[0].placement->point_to_world(point));
}

TEST(ParseScene, Transforms) {
  EXPECT_EQ(placed("[1, 0, 0, 10, 0, 2, 0, 20, 0, 0, 4, 30]", {1, 2, 3}), (Vec3{11, 24, 42}));
  EXPECT_EQ(placed("[0, -1, 0, 10, 1, 0, 0, 20, 0, 0, 1, 30, 0, 0, 0, 1]", {1, 2, 3}), (Vec3{8, 21, 33}));
  EXPECT_EQ(placed(R"({"translate": [1, 2, 3]})", {1, 1, 1}), (Vec3{2, 3, 4}));
  EXPECT_EQ(placed(R"({"scale": 2})", {1, 2, 3}), (Vec3{2, 4, 6}));
  EXPECT_EQ(placed(R"({"scale": [1, -2, 4]})", {1, 1, 1}), (Vec3{1, -2, 4}));
  // Quarter turns are exact.
  EXPECT_EQ(placed(R"({"rotate": {"axis": [0, 0, 1], "degrees": 90}})", {1, 2, 3}), (Vec3{-2, 1, 3}));
  EXPECT_EQ(placed(R"({"rotate": {"axis": [0, 0, 9], "degrees": -90}})", {1, 2, 3}), (Vec3{2, -1, 3}));
  EXPECT_EQ(placed(R"({"rotate": {"axis": [1, 0, 0], "degrees": 180}})", {1, 2, 3}), (Vec3{1, -2, -3}));
  EXPECT_EQ(placed(R"({"rotate": {"axis": [0, 1, 0], "degrees": 450}})", {1, 2, 3}), (Vec3{3, 2, -1}));
  // A third of a turn about the diagonal takes each axis to the next.
  const Vec3 turned = placed(R"({"rotate": {"axis": [1, 1, 1], "degrees": 120}})", {1, 2, 3});
  EXPECT_NEAR(turned.x, 3, 1e-6);
  EXPECT_NEAR(turned.y, 1, 1e-6);
  EXPECT_NEAR(turned.z, 2, 1e-6);
  // Scale, then rotate, then translate.
  EXPECT_EQ(placed(R"({"translate": [10, 0, 0], "rotate": {"axis": [0, 0, 1], "degrees": 90}, "scale": [2, 1, 1]})",
                   {1, 0, 0}),
            (Vec3{10, 2, 0}));
}

TEST(ParseScene, DroppedTrianglesAreCountedAndReported) {
  const Scene scene = parsed(R"({"lights": [{"type": "ambient", "radiance": [1, 1, 1]}],
    "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1},
    {"type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1e30], [0, 1, 0]],
     "triangles": [[0, 1, 3], [0, 1, 2], [0, 1, 1], [0, 2, 4]]},
    {"type": "mesh", "positions": [], "triangles": []}]})");
  EXPECT_EQ(std::get<TriangleMesh>(scene.shapes[1]).triangles, (std::vector<TriangleIndices>{{0, 1, 2}}));
  ASSERT_EQ(scene.warnings.size(), 2U);
  EXPECT_EQ(scene.warnings[0].pointer, "/objects/1");
  EXPECT_EQ(scene.warnings[0].detail,
            "Dropped triangles: 1 with coordinates beyond 1e18, 2 with two corners at one place.");
  EXPECT_EQ(scene.warnings[1].pointer, "/objects/2");
}

TEST(ParseScene, WarningsDoNotGrowWithoutBound) {
  std::string text = R"({"lights": [{"type": "ambient", "radiance": [1, 1, 1]}], "objects": [)";
  for (int i = 0; i < 500; ++i) text += R"({"type": "mesh", "positions": [], "triangles": []},)";
  text.back() = ']';
  const Scene scene = parsed(text + "}");
  ASSERT_EQ(scene.warnings.size(), 101U);
  EXPECT_EQ(scene.warnings.back().detail, "There are 400 more warnings.");
}

// ---- limits ----

/// The one error of a document, as "pointer: detail".
std::string only_error(std::string_view text, const Limits& limits) {
  const auto result = parse_scene(text, NoFiles(), limits);
  if (result) return "accepted";
  EXPECT_EQ(result.problem().code, ProblemCode::invalid_document);
  if (result.problem().errors.size() != 1) return std::to_string(result.problem().errors.size()) + " errors";
  return result.problem().errors[0].pointer + ": " + result.problem().errors[0].detail;
}

constexpr std::string_view kThreeInstances = R"({"geometries": {"pair": {"type": "mesh",
    "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], "triangles": [[0, 1, 2], [1, 2, 3]]}}, "objects": [
    {"type": "instance", "of": "pair"}, {"type": "instance", "of": "pair"}, {"type": "instance", "of": "pair"}]})";

TEST(ParseScene, PrimitivesAreLimitedWithInstancesCounted) {
  Limits limits;
  limits.max_primitives = 6;
  EXPECT_EQ(only_error(kThreeInstances, limits), "accepted");
  limits.max_primitives = 5;
  EXPECT_TRUE(only_error(kThreeInstances, limits).starts_with("/objects/2: The scene has more than 5 primitives"));
}

TEST(ParseScene, ObjectsAreLimited) {
  Limits limits;
  limits.max_objects = 3;
  EXPECT_EQ(only_error(kThreeInstances, limits), "accepted");
  limits.max_objects = 2;
  EXPECT_TRUE(only_error(kThreeInstances, limits).starts_with("/objects/2: The scene has more than 2 objects"));
}

TEST(ParseScene, MemoryIsLimited) {
  Limits limits;
  limits.max_scene_bytes =
      sizeof(Shape) + sizeof(Aabb) + 4 * sizeof(Vec3) + 2 * sizeof(TriangleIndices) + 3 * sizeof(Object);
  EXPECT_EQ(only_error(kThreeInstances, limits), "accepted");
  --limits.max_scene_bytes;
  EXPECT_TRUE(only_error(kThreeInstances, limits).starts_with("/objects/2: The scene takes more than"));
  limits.max_scene_bytes = sizeof(Shape);
  const auto result = parse_scene(kThreeInstances, NoFiles(), limits);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.problem().errors.at(0).pointer, "/geometries/pair");
}

TEST(ParseScene, DepthIsLimited) {
  Limits limits;
  limits.max_depth = 4;
  EXPECT_EQ(only_error(R"({"objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}]})", limits), "accepted");
  const auto result = parse_scene(R"({"objects": [[[[[]]]]]})", NoFiles(), limits);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.problem().code, ProblemCode::malformed_json);
}

TEST(ParseScene, AtMostTwentyErrorsAreCollected) {
  std::string text = R"({"objects": [)";
  for (int i = 0; i < 100; ++i) text += "{},";
  text.back() = ']';
  const auto result = parse_scene(text + "}", NoFiles(), Limits());
  ASSERT_FALSE(result);
  ASSERT_EQ(result.problem().errors.size(), kMaxFieldErrors);
  EXPECT_EQ(result.problem().errors.back().pointer, "/objects/19");
  EXPECT_EQ(result.problem().detail, "The scene document has at least 20 errors; `errors` says where.");
}

TEST(ParseScene, LongTextsOfTheUserAreCutInMessages) {
  const auto result = parse_scene(R"({"objects": [], ")" + std::string(100'000, 'x') + R"(": 1})", NoFiles(), Limits());
  ASSERT_FALSE(result);
  EXPECT_LT(to_json(result.problem()).dump().size(), 2000U);
}

TEST(ParseScene, MessagesSayWhatWasFoundAndHowToMendIt) {
  EXPECT_EQ(only_error(R"({"objects": [{"type": "sphere", "center": [0, 0, 0], "radius": "wide"}]})", Limits()),
            "/objects/0/radius: Expected a number greater than 0 and less than 1e18, found the string \"wide\".");
  EXPECT_EQ(only_error(R"({"objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "r": 2}]})", Limits()),
            "/objects/0/r: Unknown field \"r\": a sphere has only type, material, transform, center, radius.");
  EXPECT_EQ(only_error(R"({"objects": [{"type": "torus"}]})", Limits()),
            "/objects/0/type: Expected one of the strings mesh, sphere, cylinder, cone, disk, quad, file, instance, "
            "found the string \"torus\".");
  EXPECT_EQ(only_error(R"({"materials": {"red": {"type": "whitted"}, "blue": {"type": "whitted"}},
                           "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "rde"}]})",
                       Limits()),
            "/objects/0/material: Nothing in \"materials\" is named \"rde\": there are \"blue\", \"red\".");
  EXPECT_EQ(
      only_error(R"({"objects": [{"type": "mesh", "positions": [[0, 0, 0]], "triangles": [[0, 0, 1]]}]})", Limits()),
      "/objects/0/triangles/0/2: Index 1 is out of range: with this many positions, 0 to 0 will do.");
}

TEST(ParseScene, ASourceOfFilesThatThrowsIsAnInternalErrorAndNotACrash) {
  struct Throwing : NoFiles {
    Result<SourceFile> asset(std::string_view, const std::stop_token&) const override {
      throw std::runtime_error("disk on fire");
    }
  };
  const auto result = parse_scene(R"({"objects": [{"type": "file", "path": "a.obj"}]})", Throwing(), Limits());
  ASSERT_FALSE(result);
  EXPECT_EQ(result.problem().code, ProblemCode::internal_error);
}

TEST(ParseScene, RunningOutOfMemoryIsNoFaultOfTheDocument) {
  struct Exhausted : NoFiles {
    Result<SourceFile> asset(std::string_view, const std::stop_token&) const override { throw std::bad_alloc(); }
  };
  const auto result = parse_scene(R"({"objects": [{"type": "file", "path": "a.obj"}]})", Exhausted(), Limits());
  ASSERT_FALSE(result);
  EXPECT_EQ(result.problem().code, ProblemCode::out_of_memory_budget);
}

TEST(ParseScene, ASceneWithoutLightIsTold) {
  const auto warnings = [](const std::string& rest) {
    const std::string sphere = R"({"objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}])";
    return parse_scene(sphere + rest + "}", NoFiles(), Limits())->scene->warnings;
  };
  for (const char* dark : {"", R"(, "lights": [])", R"(, "lights": [{"type": "ambient", "radiance": [0, 0, 0]},
                           {"type": "point", "position": [0, 0, 0], "intensity": [0, 0, 0]},
                           {"type": "directional", "direction": [0, 0, 1], "irradiance": [0, 0, 0]}])"}) {
    ASSERT_EQ(warnings(dark).size(), 1U) << dark;
    EXPECT_EQ(warnings(dark)[0].pointer, std::string_view(dark).empty() ? "" : "/lights");
    EXPECT_NE(warnings(dark)[0].detail.find("its surfaces are black"), std::string::npos);
  }
  EXPECT_EQ(warnings(R"(, "background": [0, 0, 0.1])").size(), 1U) << "the sphere is black all the same";
  for (const char* lit : {R"(, "background": [0, 0, 0.1], "materials": {"a": {"type": "diffuse", "color": [1, 1, 1]}},
             "lights": [{"type": "ambient", "radiance": [0, 1, 0]}])",
                          R"(, "lights": [{"type": "ambient", "radiance": [0, 1, 0]}])"}) {
    EXPECT_TRUE(warnings(lit).empty()) << lit;
  }
  EXPECT_TRUE(parse_scene(R"({"objects": []})", NoFiles(), Limits())->scene->warnings.empty());
}

TEST(ParseScene, WhatEmitsOrSurroundsIsLight) {
  const auto warnings = [](const std::string& rest) {
    const std::string sphere = R"({"objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}])";
    return parsed(sphere + rest + "}").warnings;
  };
  const std::string clay = R"(, "materials": {"m": {"type": "diffuse", "color": [1, 1, 1]}})";
  const std::string metal = R"(, "materials": {"m": {"type": "conductor", "metal": "gold"}})";
  EXPECT_TRUE(
      warnings(R"(, "materials": {"m": {"type": "diffuse", "color": [1, 1, 1], "emission": [0, 1, 0]}})").empty());
  EXPECT_TRUE(warnings(R"(, "materials": {"m": {"type": "unlit", "color": [0, 1, 0]}})").empty());
  EXPECT_TRUE(warnings(clay + R"(, "lights": [{"type": "environment"}])").empty());
  EXPECT_TRUE(
      warnings(clay + R"(, "lights": [{"type": "sun", "direction": [0, 1, 0], "irradiance": [1, 1, 1]}])").empty());
  EXPECT_TRUE(warnings(metal + R"(, "background": [1, 1, 1])").empty());
  EXPECT_EQ(warnings(clay + R"(, "background": [1, 1, 1])").size(), 1U) << "Whitted's surfaces don't see it";
  EXPECT_EQ(warnings(metal).size(), 1U);
  EXPECT_EQ(warnings(clay + R"(, "lights": [{"type": "environment", "radiance": [0, 0, 0]}])").size(), 1U);
  EXPECT_EQ(warnings(R"(, "materials": {"m": {"type": "diffuse", "color": [1, 1, 1], "emission": [0, 0, 0]}})").size(),
            1U);
}

TEST(ParseScene, WhatEmitsWithoutAnAreaIsTold) {
  const auto details = [](const std::string& mesh, const std::string& emission) {
    const Scene scene = parsed(R"({"lights": [{"type": "environment"}], "materials": {"lamp": {"type": "diffuse",
        "color": [0, 0, 0], "emission": )" +
                               emission + R"(}}, "objects": [{"type": "mesh", "material": "lamp", )" + mesh + "}]}");
    std::vector<std::string> told;
    for (const SceneWarning& warning : scene.warnings) {
      EXPECT_EQ(warning.pointer, "/objects/0");
      told.push_back(warning.detail);
    }
    return told;
  };
  constexpr const char* kLamp = "The material emits, and the mesh has no area to send light from.";
  const std::string line = R"("positions": [[0, 0, 0], [1, 1, 1], [3, 3, 3]], "triangles": [[0, 1, 2]])";
  EXPECT_EQ(details(line, "[1, 1, 1]"), std::vector<std::string>{kLamp});
  EXPECT_TRUE(details(line, "[0, 0, 0]").empty());
  const std::string dropped = R"("positions": [[0, 0, 0], [1, 1, 1], [0, 0, 0]], "triangles": [[0, 1, 2]])";
  EXPECT_EQ(details(dropped, "[1, 1, 1]").back(), kLamp) << "beside what was dropped";
  EXPECT_EQ(details(R"("positions": [], "triangles": [])", "[1, 1, 1]").back(), kLamp);
  const std::string sliver = R"("positions": [[0, 0, 0], [1, 1, 1], [3, 3, 3.0000002]], "triangles": [[0, 1, 2]])";
  EXPECT_TRUE(details(sliver, "[1, 1, 1]").empty());
}

TEST(ParseScene, RefusalsOfLightSayHowToMendIt) {
  const auto material = [](const std::string& m) {
    return only_error(R"({"objects": [], "materials": {"m": {)" + m + "}}}", Limits());
  };
  EXPECT_EQ(material(R"("type": "conductor", "metal": "gold", "roughness": 1.5)"),
            "/materials/m/roughness: Expected a number from 0 to 1, found 1.5.");
  EXPECT_EQ(material(R"("type": "dielectric", "ior": 0)"),
            "/materials/m/ior: Expected a number from 0.001 to 1000, found 0.");
  EXPECT_EQ(material(R"("type": "metallic_roughness", "thin": false)"),
            "/materials/m/thin: \"thin\" says more of \"transmission\", and there is none; add it.");
  EXPECT_EQ(material(R"("type": "metallic_roughness", "transmission": 1, "absorption": [1, 1, 1])"),
            "/materials/m/absorption: \"absorption\" is of what is inside, and this material lets no light in; give it "
            "\"transmit\", or \"transmission\" with \"thin\": false.");
  EXPECT_EQ(material(R"("type": "diffuse", "color": [0, 0, 0], "emits": "both")"),
            "/materials/m/emits: \"emits\" says where \"emission\" goes, and there is none; add it.");
  const auto camera = [](const std::string& c) {
    return only_error(
        R"({"objects": [], "camera": {"type": "perspective", "from": [0, 0, 5], "at": [0, 0, 0], )" + c + "}}",
        Limits());
  };
  EXPECT_EQ(
      camera(R"("lens": {"radius": 1, "focus_distance": -2})"),
      "/camera/lens/focus_distance: Expected a distance in front of the camera, greater than 0 and less than 1e18, "
      "found -2.");
  EXPECT_EQ(camera(R"("near": 3, "far": 2)"),
            "/camera/far: \"far\" must be greater than \"near\", or nothing is seen between them.");
  EXPECT_TRUE(camera(R"("azimuth": 3)").starts_with("/camera/azimuth: Unknown field")) << "where it has a place";
  const auto unplaced = [](const std::string& c) {
    return only_error(R"({"objects": [], "camera": {"type": "orthographic", )" + c + "}}", Limits());
  };
  EXPECT_EQ(unplaced(R"("direction": [0, 0, 1], "elevation": 3)"),
            "/camera/elevation: \"direction\" says this already; leave it or the angles out.");
  EXPECT_EQ(unplaced(R"("elevation": 91)"),
            "/camera/elevation: Expected an angle in degrees from -90 to 90, found 91.");
  EXPECT_EQ(unplaced(R"("azimuth": -361)"),
            "/camera/azimuth: Expected an angle in degrees from -360 to 360, found -361.");
}

TEST(ParseScene, StopsWhenNobodyWantsIt) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(parse_scene(R"({"objects": []})", NoFiles(), Limits(), stop.get_token()), Abandoned);
}

}  // namespace
}  // namespace tessera::proto
