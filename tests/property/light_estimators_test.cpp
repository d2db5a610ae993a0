// STRESS 59 and 68: ways to one mean, and how fast samples come to it.
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/integrator/shading.h"
#include "core/integrator/spawn.h"
#include "core/light/light_table.h"
#include "core/material/bsdf.h"
#include "core/sampling/warp.h"
#include "tests/support/effort.h"
#include "tests/support/light_images.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

constexpr double kPi = std::numbers::pi;

/// The point of a floor that a camera looks at, and what light it reflects there: by sampling lights, by sampling the
/// surface, or by both.
class ShadedPoint {
 public:
  ShadedPoint(std::shared_ptr<const Scene> scene, const Ray& ray)
      : scene_(std::move(scene)),
        lights_(scene_),
        accel_(make_accel(scene_, {AccelKind::brute})),
        hit_(accel_->closest(ray).value()),
        shading_(world_surface(*scene_, hit_.object, hit_.primitive, ray, hit_.t), ray.direction),
        bsdf_(make_bsdf(scene_->materials[scene_->objects[hit_.object].material].surface, shading_.entering)),
        frame_(basis_around(shading_.normal)) {}

  enum class Way { lights, surface, both };

  Moments estimate(Way way, int count, std::uint64_t seed) const {
    Random random(seed);
    Moments moments;
    const auto u = [&] { return static_cast<float>(random.bits() >> 40) * 0x1p-24F; };
    for (int i = 0; i < count; ++i) {
      const float pick = u(), lobe = u();
      const Vec2 on_light{u(), u()}, direction{u(), u()};
      double sum = 0;
      if (way != Way::surface) sum += by_light(way, pick, on_light);
      if (way != Way::lights) sum += by_surface(way, lobe, direction);
      moments.add(sum);
    }
    return moments;
  }

 private:
  Vec3 from(Vec3 direction) const {
    const Vec3 normal = shading_.flat_normal;
    return spawn_origin(shading_.surface, to_double(dot(direction, normal) > 0 ? normal : -normal));
  }
  // Lights are asked for without a normal: no way is closed to them then.
  double by_light(Way way, float pick, Vec2 u) const {
    const auto light = lights_.sample(lights_.viewpoint(shading_.surface.position, {}), pick, u);
    if (!light) return 0;
    const BsdfValue value = evaluate(bsdf_, frame_.to_local(shading_.to_viewer), frame_.to_local(light->to_light));
    if (value.f_cos.is_black()) return 0;
    if (accel_->occluded(lights_.shadow_ray(*light, from(light->to_light)))) return 0;
    // The balance heuristic: other weights than the path tracer's have to give the same.
    const double weight = way == Way::both && !light->is_delta ? light->pdf / (double{light->pdf} + value.pdf) : 1;
    return weight * value.f_cos.g * light->radiance.g / light->pdf;
  }
  double by_surface(Way way, float lobe, Vec2 u) const {
    const auto chosen = sample(bsdf_, frame_.to_local(shading_.to_viewer), lobe, u);
    if (!chosen) return 0;
    const Vec3 direction = frame_.to_world(chosen->wi);
    const Ray ray{from(direction), direction};
    const auto hit = accel_->closest(ray);
    Rgb radiance;
    double pdf = 0;
    if (hit) {
      const SurfacePoint there = world_surface(*scene_, hit->object, hit->primitive, ray, hit->t);
      radiance = emitted(*scene_, hit->object, direction, there.geometric_normal);
      pdf = lights_.pdf_hit(lights_.viewpoint(shading_.surface.position, {}), direction, {hit->object, hit->primitive},
                            length(there.position - shading_.surface.position), there.geometric_normal);
    } else {
      const auto far = lights_.escaped(lights_.viewpoint(shading_.surface.position, {}), direction);
      radiance = far.radiance;
      pdf = far.pdf;
    }
    const double weight = way == Way::both && !chosen->is_delta ? chosen->pdf / (double{chosen->pdf} + pdf) : 1;
    return weight * chosen->weight.g * radiance.g;
  }

  std::shared_ptr<const Scene> scene_;
  LightTable lights_;
  std::unique_ptr<const Accel> accel_;
  Hit hit_;
  Shading shading_;
  Bsdf bsdf_;
  Basis frame_;
};

struct Named {
  std::string name;
  Material material;
};
std::vector<Named> floors() {
  const Rgb eta{0.2F, 0.9F, 1.1F}, k{3.9F, 2.4F, 2.2F};
  return {{"diffuse", {Diffuse{grey(0.7F)}}},
          {"phong", {WhittedSurface{.diffuse = grey(0.3F), .specular = grey(0.5F), .shininess = 12}}},
          {"rough conductor", {Conductor{eta, k, 0.5F}}},
          {"rough glass", {Dielectric{1.5F, 0.5F}}},
          {"plastic", {MetallicRoughness{{0.8F, 0.5F, 0.2F}, 0, 0.4F}}},
          {"rough metal", {MetallicRoughness{{0.8F, 0.5F, 0.2F}, 1, 0.8F}}},
          {"all of Whitted's",
           {WhittedSurface{.diffuse = grey(0.3F),
                           .specular = grey(0.2F),
                           .shininess = 3,
                           .reflect = grey(0.3F),
                           .transmit = grey(0.4F),
                           .ior = 1.3F,
                           .fresnel = true}}}};
}

/// Fills in lights, all of which the surface can meet by chance.
struct Lights {
  std::string name;
  std::function<void(SceneBuilder&)> add;
};
std::vector<Lights> lights() {
  const auto lamp = [](SceneBuilder& b, float radiance, bool both = false) {
    return b.material(Material{.surface = Diffuse{{}}, .emission = grey(radiance), .emits_both_sides = both});
  };
  return {
      {"quad",
       [=](SceneBuilder& b) {
         b.add(Quad{{{{0.3F, 1, 1}, {1.5F, 1, 0.9F}, {1.5F, -1, 0.7F}, {0.3F, -1, 0.6F}}}}, lamp(b, 4, true));
       }},
      {"sphere and disk",
       [=](SceneBuilder& b) {
         b.add(Sphere{{0.9F, 0.1F, 0.8F}, 0.4F}, lamp(b, 4));
         b.add(Disk{{-0.4F, 1, 0.9F}, *UnitVec3::normalize(Vec3{0.4F, -1, -0.9F}), 0.5F}, lamp(b, 9));
       }},
      {"ellipsoid behind a fence",
       [=](SceneBuilder& b) {
         b.place(b.shape(Sphere{{0, 0, 0}, 1}), lamp(b, 3), placed({0.5, 0.1, 0, 0.6, 0, 0.9, 0, 0.2, 0.2, 0, 0.3, 1}));
         b.add(Quad{{{{0.2F, -1, 0.4F}, {0.5F, -1, 0.4F}, {0.5F, 1, 0.4F}, {0.2F, 1, 0.4F}}}},
               b.material(Material{Diffuse{{}}}));
       }},
      {"mirrored instances",
       [=](SceneBuilder& b) {
         const auto one_sided = lamp(b, 5, false);
         b.place(b.shape(horizontal(0.4F, 0)), one_sided, placed({1, 0, 0.1, 0.7, 0, 1, 0, 0.3, 0.2, 0, -1, 0.8}));
         b.place(b.shape(grid_plane(2)), one_sided, placed({-0.3, 0, 0, -0.3, 0, 0.3, 0, 0.9, 0, 0.2, 1, 0.7}));
         b.place(b.shape(Disk{{0, 0, 0}, -UnitVec3::z(), 0.4F}), one_sided,
                 placed({-1, 0, 0, 0.9, 0, 1, 0, -0.9, 0.3, 0.1, 1, 0.6}));
         b.place(b.shape(icosphere(0, 0.2F)), one_sided, placed({1, 0, 0, 0.2, 0, -1, 0, -0.7, 0, 0, 1.5, 0.5}));
       }},
      {"mesh",
       [=](SceneBuilder& b) {
         b.add(icosphere(1, 0.5F, {0.8F, 0.2F, 0.9F}), lamp(b, 4));
       }},
      {"sky",
       [](SceneBuilder& b) {
         b.background({1, 2, 3});
       }},
      {"map and sun",
       [](SceneBuilder& b) {
         EnvironmentMap map{8, 4, std::vector<Rgb>(32, grey(0.3F))};
         map.texels[10] = grey(20);
         b.light(EnvironmentLight{.map = std::make_shared<const EnvironmentMap>(map),
                                  .to_world = {1, 0, 0, 0, 0, -1, 0, 1, 0}});
         b.light(SunLight{*UnitVec3::normalize(Vec3{-1, 0.3F, -1}), {1, 1, 1}, 0.5F});
       }},
      {"sky and lamps", [=](SceneBuilder& b) {
         b.background({0.3F, 0.3F, 0.3F})
             .add(Quad{{{{0.3F, 1, 1}, {0.3F, -1, 1}, {1.5F, -1, 1}, {1.5F, 1, 1}}}}, lamp(b, 2));
         b.add(icosphere(0, 0.2F, {-0.6F, -0.6F, 0.5F}), lamp(b, 6));
         b.add(Cylinder{{-1, 1, 0.3F}, {1, 1, 0.3F}, 0.1F}, lamp(b, 3));
       }}};
}

TEST(LightEstimators, ComeToOneMean_Stress68) {
  const double level = sidak(0.01, static_cast<double>(floors().size() * lights().size() * 3));
  std::size_t pair = 0;
  for (const Named& floor : floors())
    for (const Lights& light : lights()) {
      if (pair++ % 3 != 0 && !long_tests()) continue;  // each floor and each light at least twice
      SceneBuilder b;
      b.material(floor.material);
      light.add(b.add(horizontal(6, 0)));
      const auto scene = b.build();
      // From aslant, past all lamps.
      const Camera camera = OrthographicCamera{{{-1.2F, 0.1F, 1.3F}, {0, 0, 0}, {0, 0, 1}}, 1e-4F};
      const int count = effort(20'480, 4'096'000);
      const Settings settings = light_settings(IntegratorKind::direct, 32, static_cast<std::uint32_t>(count / 1024));
      const Moments path = moments_of(render_image(scene, camera, settings).pixels);
      const ShadedPoint point(scene, {{-1.2F, 0.1F, 1.3F}, *UnitVec3::normalize(Vec3{1.2F, -0.1F, -1.3F})});
      EXPECT_GT(path.mean(), 0) << light.name;
      for (const auto way : {ShadedPoint::Way::lights, ShadedPoint::Way::surface, ShadedPoint::Way::both}) {
        // What the surface passes or mirrors straight, sampling lights doesn't know, nor that cylinders emit.
        if (way == ShadedPoint::Way::lights && (floor.name == "all of Whitted's" || light.name == "sky and lamps"))
          continue;
        const Moments other = point.estimate(way, count, static_cast<std::uint64_t>(way));
        EXPECT_TRUE(std::abs(other.mean() / path.mean() - 1) < 1e-5 || welch_test(path, other) > level)
            << floor.name << ", " << light.name << ", way " << static_cast<int>(way) << ": " << other.mean() << " ± "
            << other.standard_error() << ", path tracer " << path.mean() << " ± " << path.standard_error();
      }
    }
}

/// The slope of y over x in a plot whose axes are logarithms.
double log_slope(const std::vector<double>& x, const std::vector<double>& y) {
  Moments mx, my;
  for (std::size_t i = 0; i < x.size(); ++i) mx.add(std::log(x[i])), my.add(std::log(y[i]));
  double xy = 0, xx = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double dx = std::log(x[i]) - mx.mean();
    xy += dx * (std::log(y[i]) - my.mean());
    xx += dx * dx;
  }
  return xy / xx;
}

/// A room that shows 2 all over, and a floor of one known brightness: a floor in the curve would be bias.
TEST(LightEstimators, ErrorsFallAsTheyShould_Stress59) {
  SceneBuilder room;
  room.material(Material{.surface = Diffuse{grey(0.5F)}, .emission = {1, 1, 1}, .emits_both_sides = true});
  room.add(Sphere{{0, 0, 0}, 1});
  SceneBuilder floor;
  floor.material(Material{.surface = Diffuse{{1, 1, 1}}});
  const auto lamp = floor.material(Material{.surface = Diffuse{{}}, .emission = {1, 1, 1}});
  // Over the middle of a disk the irradiance is π r² / (r² + h²).
  floor.add(horizontal(5, 0)).add(Disk{{0, 0, 1}, -UnitVec3::z(), 1}, lamp);
  struct Known {
    const char* name;
    std::shared_ptr<const Scene> scene;
    Camera camera;
    double due;
  };
  const Known known[] = {
      {"room", room.build(), PerspectiveCamera{{{0.1F, 0.2F, -0.3F}, {1, 0.4F, 0.3F}, {0, 1, 0}}, 1}, 2},
      {"floor", floor.build(), down_at(0, 0), 0.5}};
  for (const auto& [name, scene, camera, due] : known) {
    std::vector<double> errors[2];
    std::vector<double> counts;
    for (std::uint32_t n = 1; n <= static_cast<std::uint32_t>(effort(64, 4096)); n *= 4) counts.push_back(n);
    for (const SamplerKind sampler : {SamplerKind::independent, SamplerKind::sobol})
      for (const double n : counts) {
        Settings settings = light_settings(IntegratorKind::path, 64, static_cast<std::uint32_t>(n), 48);
        settings.sampler = sampler;
        double squares = 0;
        const Pixels seen = render_image(scene, camera, settings).pixels;
        for (const Rgb& c : seen.color) squares += (c.g - due) * (c.g - due);
        errors[sampler == SamplerKind::sobol].push_back(std::sqrt(squares / static_cast<double>(seen.color.size())));
      }
    EXPECT_NEAR(log_slope(counts, errors[0]), -0.5, 0.05) << name;
    EXPECT_LT(log_slope(counts, errors[1]), -0.45) << name;
    // Numbers that are stratified by themselves are never much worse than random ones: their variance is n / (n - 1)
    // times as large at most (Owen 1997, of Latin hypercubes).
    for (std::size_t i = 1; i < counts.size(); ++i) {
      EXPECT_LT(errors[1][i], errors[0][i] * std::sqrt(counts[i] / (counts[i] - 1))) << name << ", " << counts[i];
    }
  }
}

/// One light of 2^26 W/sr outshines 2^18 of 1 W/sr at the same place: as each has the same share wherever it is asked
/// for, a number of 23 bits would always pick the same one of eight.
TEST(LightEstimators, NoneOfManyDimLightsIsOutOfReach) {
  constexpr std::uint32_t kDim = 1 << 18;
  constexpr float kAll = 0x1p26F;
  SceneBuilder b;
  b.material(Material{.surface = Diffuse{{1, 1, 1}}});
  b.add(horizontal(9, 0));
  const auto light = [&](Rgb intensity) { b.light(PointLight{{0, 0, 1}, intensity}); };
  light({0, 0, 3 * (kAll - kDim)});
  // Green are the two in the middle of each eight, between which a coarse number would fall.
  for (std::uint32_t i = 1; i < kDim; ++i) light(i % 8 == 3 || i % 8 == 4 ? Rgb{0, 3, 0} : Rgb{3, 0, 0});
  const Pixels seen = render_image(b.build(), down_at(0, 0), light_settings(IntegratorKind::direct, 64, 64)).pixels;
  const double green = moments_of(seen, &Rgb::g).mean(), red = moments_of(seen, &Rgb::r).mean();
  EXPECT_GT(red, 0);
  EXPECT_NEAR(green / (green + red), 0.25, 0.06) << "of about a thousand";
}

}  // namespace
}  // namespace tessera
