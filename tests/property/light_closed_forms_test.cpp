// STRESS 57, 67, 72, 73, 74 and 76: light whose closed form is known, rendered.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
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
constexpr SamplerKind kSamplers[] = {SamplerKind::independent, SamplerKind::sobol};

/// What a polygon of radiance 1 sends onto a floor at a point (Lambert 1760): half the sum of its edges' angles, each
/// times the cosine of its plane to the floor. Only what is above the floor counts.
double lambert(std::vector<Vec3d> polygon, Vec3d from) {
  std::vector<Vec3d> above;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3d a = polygon[i] - from, b = polygon[(i + 1) % polygon.size()] - from;
    if (a.z > 0) above.push_back(a);
    if ((a.z > 0) != (b.z > 0)) above.push_back(a + (b - a) * (a.z / (a.z - b.z)));
  }
  double sum = 0;
  for (std::size_t i = 0; i < above.size(); ++i) {
    const Vec3d a = above[i], b = above[(i + 1) % above.size()], across = cross(a, b);
    const double sine = length(across);
    if (sine > 0) sum += std::atan2(sine, dot(a, b)) * across.z / sine;
  }
  return std::abs(sum) / 2;
}

/// A flat polygon as a fan of triangles around its first corner, which faces down or along the corners' turn.
struct Polygon {
  std::string name;
  std::vector<Vec3> corners;

  TriangleMesh mesh() const {
    TriangleMesh mesh;
    mesh.positions = corners;
    for (std::uint32_t i = 1; i + 1 < corners.size(); ++i) mesh.triangles.push_back({0, i, i + 1});
    return mesh;
  }
  /// Triangle by triangle: a part may lie below the horizon.
  double irradiance(Vec3d from) const {
    double sum = 0;
    for (const TriangleIndices& t : mesh().triangles)
      sum += lambert({to_double(corners[t[0]]), to_double(corners[t[1]]), to_double(corners[t[2]])}, from);
    return sum;
  }
};

/// Regular in a plane at height z, or its corners at two radii in turn: a star, whose first corner sees all others.
Polygon regular(std::string name, int corners, float inner, float z) {
  Polygon polygon{std::move(name), {}};
  for (int i = 0; i < corners; ++i) {
    const double turn = -2 * kPi * i / corners, r = i % 2 ? 0.8 : inner;
    polygon.corners.push_back(to_float(Vec3d{0.3 + r * std::cos(turn), r * std::sin(turn) - 0.2, z}));
  }
  return polygon;
}

std::vector<Polygon> polygons() {
  return {{"triangle", {{-0.5F, 0.9F, 1}, {1.2F, -0.3F, 0.8F}, {-0.7F, -0.8F, 1.4F}}},
          {"upright, half below the floor", {{1, -1, -0.5F}, {1, -1, 0.7F}, {1, 1, 0.7F}, {1, 1, -0.5F}}},
          regular("hexagon", 6, 0.8F, 0.6F),
          regular("octagon with dents", 8, 0.7F, 2),
          {"sliver", {{-2, 0.5F, 0.5F}, {2, 0.5F, 0.5F}, {2, 0.51F, 0.5F}, {-2, 0.51F, 0.5F}}}};
}

TEST(LightClosedForms, PolygonsLightFloorsAsLambertSays_Stress57) {
  const double level = sidak(0.01, 5 * 2 * 2);
  for (const Polygon& polygon : polygons())
    for (const SamplerKind sampler : kSamplers)
      for (const bool as_quad : {false, true}) {
        if (as_quad && polygon.corners.size() != 4) continue;
        SceneBuilder b;
        b.material(Material{.surface = Diffuse{grey(0.6F)}});
        const auto lamp = b.material(Material{.surface = Diffuse{{}}, .emission = {2, 3, 5}, .emits_both_sides = true});
        b.add(horizontal(9, 0));
        if (as_quad)
          b.add(Quad{{polygon.corners[0], polygon.corners[1], polygon.corners[2], polygon.corners[3]}}, lamp);
        else
          b.add(polygon.mesh(), lamp);
        Settings settings = light_settings(IntegratorKind::direct, 32, static_cast<std::uint32_t>(effort(16, 1024)));
        settings.sampler = sampler;
        // From below the lowest lamp.
        const Moments mean = moments_of(render_image(b.build(), down_at(0.1F, 0.05F, 0.3F), settings).pixels);
        const double due = 0.6 / kPi * 3 * polygon.irradiance({double{0.1F}, double{0.05F}, 0});
        EXPECT_GT(t_test(mean, due), level)
            << polygon.name << (as_quad ? " as a quad" : "") << ", sampler " << static_cast<int>(sampler) << ": "
            << mean.mean() << " ± " << mean.standard_error() << ", due " << due;
      }
}

/// A lamp in a room of two floors: what it sends down, and up.
TEST(LightClosedForms, OneSidedLightLeavesTheFrontAlone_Stress72) {
  for (const bool both : {false, true}) {
    SceneBuilder b;
    b.material(Material{.surface = Diffuse{grey(0.5F)}});
    const auto lamp = b.material(Material{.surface = Diffuse{{}}, .emission = {1, 1, 1}, .emits_both_sides = both});
    b.add(horizontal(5, -1)).add(horizontal(5, 1, false)).add(horizontal(0.7F, 0, false), lamp);
    const auto scene = b.build();
    const Settings settings = light_settings(IntegratorKind::direct, 8, 16);
    const auto seen = [&](Vec3 from, Vec3 at) {
      return extremes_of(render_image(scene, OrthographicCamera{{from, at, {0, 1, 0}}, 0.2F}, settings).pixels);
    };
    EXPECT_EQ(seen({0, 0, -0.5F}, {0, 0, 0}).least, 1) << "its front";
    EXPECT_EQ(seen({0, 0, 0.5F}, {0, 0, 0}).most, both ? 1 : 0) << "its back";
    EXPECT_GT(seen({0, 0, -0.5F}, {0, 0, -1}).least, 0) << "before it";
    EXPECT_EQ(seen({0, 0, 0.5F}, {0, 0, 1}).most > 0, both) << "behind it";
  }
}

TEST(LightClosedForms, TrianglesAreAsBrightAsTheQuadTheyTile_Stress72) {
  const auto image = [](const Shape& lamp, double turn) {
    SceneBuilder b;
    b.material(Material{.surface = Diffuse{grey(0.5F)}});
    const auto shines = b.material(Material{.surface = Diffuse{{}}, .emission = {1, 1, 1}});
    b.add(horizontal(9, 0));
    // Facing down, aslant.
    b.place(b.shape(lamp), shines, placed({0.7, 0, 0.2, 0.4, 0, -0.7, turn, 0.1, -0.1, 0, -0.7, 0.9}));
    return moments_of(
        render_image(b.build(), down_at(0.2F, -0.1F, 0.1F),
                     light_settings(IntegratorKind::direct, 32, static_cast<std::uint32_t>(effort(16, 512))))
            .pixels);
  };
  for (const double turn : {0.0, 0.5}) {
    const Moments quad = image(horizontal(1, 0), turn);
    for (const std::uint32_t n : {1U, 3U, 20U}) {
      TriangleMesh tiles = grid_plane(n);
      EXPECT_GT(welch_test(image(tiles, turn), quad), sidak(0.01, 12)) << n;
      // Those without area, as many again, at a corner and along an edge.
      const auto last = static_cast<std::uint32_t>(tiles.positions.size() - 1);
      tiles.positions.insert(tiles.positions.end(), {{0, -1, 0}, {-1, -1, 0}, {-1, -1, 0}});
      for (std::size_t i = 0, size = tiles.triangles.size(); i < size; ++i)
        tiles.triangles.push_back(i % 2 ? TriangleIndices{0, n, last + 1} : TriangleIndices{0, last + 2, last + 3});
      EXPECT_GT(welch_test(image(tiles, turn), quad), sidak(0.01, 12)) << n << ", and triangles without area";
    }
  }
}

/// A floor lit from `height` above its middle, seen from above: by the distance from there.
class LitFloor {
 public:
  LitFloor(const Light& light, std::uint32_t side, float width) : side_(side), width_(width) {
    SceneBuilder b;
    b.material(Material{.surface = Diffuse{grey(0.5F)}});
    b.add(horizontal(50, 0)).light(light);
    Settings settings = light_settings(IntegratorKind::direct, side, 1);
    settings.jitter = false;
    pixels_ =
        render_image(b.build(), OrthographicCamera{{{0, 0, 9}, {0, 0, 0}, {0, 1, 0}}, width}, settings).pixels.color;
  }
  double pixel() const { return double{width_} / side_; }
  /// Calls with the distance of each pixel's centre from the middle, and with its irradiance.
  template <typename Look>
  void look(Look&& look) const {
    for (std::uint32_t y = 0; y < side_; ++y)
      for (std::uint32_t x = 0; x < side_; ++x)
        look(std::hypot(x + 0.5 - side_ / 2.0, y + 0.5 - side_ / 2.0) * pixel(),
             pixels_[std::size_t{y} * side_ + x].g / 0.5 * kPi);
  }

 private:
  std::uint32_t side_;
  float width_;
  std::vector<Rgb> pixels_;
};

TEST(LightClosedForms, SpotsHaveTheirPowerAndTheirEdges_Stress73) {
  const double height = 1.5;
  for (const auto& [inner, outer] : {std::pair{20.0, 40.0}, {0.0, 30.0}, {35.0, 36.0}}) {
    const double in = inner * kPi / 180, out = outer * kPi / 180;
    const LitFloor floor(SpotLight{{0, 0, static_cast<float>(height)},
                                   -UnitVec3::z(),
                                   {2, 2, 2},
                                   static_cast<float>(in),
                                   static_cast<float>(out)},
                         200, 3);
    double power = 0, farthest = 0, nearest_dim = 9;
    floor.look([&](double r, double irradiance) {
      power += irradiance * floor.pixel() * floor.pixel();
      const double cosine = height / std::hypot(height, r), full = 2 * std::pow(cosine, 3) / (height * height);
      const double x = std::clamp((cosine - std::cos(out)) / (std::cos(in) - std::cos(out)), 0.0, 1.0);
      EXPECT_NEAR(irradiance, full * x * x * (3 - 2 * x), 1e-5 * full) << r;
      if (irradiance > 0) farthest = std::max(farthest, r);
      if (irradiance < full * (1 - 1e-5)) nearest_dim = std::min(nearest_dim, r);
    });
    // Smoothstep lets half of the penumbra's solid angle pass.
    const double cone = 2 * 2 * kPi * ((1 - std::cos(in)) + (std::cos(in) - std::cos(out)) / 2);
    EXPECT_NEAR(power, cone, 0.003 * cone) << inner << ", " << outer;
    EXPECT_NEAR(farthest, height * std::tan(out), floor.pixel()) << inner << ", " << outer;
    // Where there is a bright disk: light that begins to fade in the middle does so too slowly to be seen.
    if (inner > 0) {
      EXPECT_NEAR(nearest_dim, height * std::tan(in), floor.pixel()) << inner << ", " << outer;
    }
  }
}

TEST(LightClosedForms, SunsHavePenumbrasOfTheirWidth_Stress74) {
  constexpr std::uint32_t kWide = 96;
  for (const double degrees : {2.0, 40.0})
    for (const double height : {0.5, 2.0}) {
      const double half = height * std::tan(degrees * kPi / 360), pixel = half / 16;
      const auto z = static_cast<float>(height);
      const auto image = [&](bool has_edge) {
        SceneBuilder b;
        b.material(Material{.surface = Diffuse{grey(0.5F)}});
        b.light(SunLight{-UnitVec3::z(), {1, 1, 1}, static_cast<float>(degrees * kPi / 180)});
        b.add(horizontal(50, 0));
        if (has_edge) b.add(Quad{{{{-50, -50, z}, {0, -50, z}, {0, 50, z}, {-50, 50, z}}}});
        Settings settings = light_settings(IntegratorKind::direct, kWide, 512);
        settings.height = 4;
        const OrthographicCamera camera{{{0, 0, z / 2}, {0, 0, 0}, {0, 1, 0}}, static_cast<float>(4 * pixel)};
        return render_image(b.build(), camera, settings).pixels;
      };
      const Pixels open = image(false), edged = image(true);
      const double mean = moments_of(open).mean() * kPi / 0.5;
      EXPECT_NEAR(mean, 1, 0.005);
      double first_lit = kWide, last_dim = -1;
      for (std::size_t i = 0; i < edged.color.size(); ++i) {
        const auto x = static_cast<double>(i % kWide);
        if (edged.color[i].g > 0) first_lit = std::min(first_lit, x);
        if (edged.color[i] != open.color[i]) last_dim = std::max(last_dim, x);
      }
      // Pixels lie between two whole numbers; the edge is at the middle one.
      EXPECT_NEAR(first_lit, kWide / 2.0 - 16, 1) << degrees << ", " << height;
      EXPECT_NEAR(last_dim + 1, kWide / 2.0 + 16, 1) << degrees << ", " << height;
    }
}

std::shared_ptr<const EnvironmentMap> sky_map() {
  EnvironmentMap map{16, 8, {}};
  for (std::uint32_t y = 0; y < map.height; ++y)
    for (std::uint32_t x = 0; x < map.width; ++x)
      map.texels.push_back(
          {0.2F + 0.1F * static_cast<float>(x % 5), 1.0F / static_cast<float>(1 + y), x == 3 && y == 2 ? 40.0F : 0.1F});
  return std::make_shared<const EnvironmentMap>(std::move(map));
}

/// A scene and its map, both turned, seen by a camera that turns with them.
Pixels turned(const std::array<double, 9>& m, const Material& material) {
  const auto turn = [&](Vec3d v) {
    return to_float(Vec3d{m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
                          m[6] * v.x + m[7] * v.y + m[8] * v.z});
  };
  SceneBuilder b;
  b.material(material);
  const auto ground = b.material(Material{.surface = Diffuse{{0.3F, 0.5F, 0.7F}}});
  EnvironmentLight light{.map = sky_map()};
  for (std::size_t i = 0; i < 9; ++i) light.to_world[i] = static_cast<float>(m[i]);
  b.light(light).add(Sphere{turn({0.3, 0.1, -0.2}), 1});
  b.add(Quad{{{turn({-3, -1, 3}), turn({3, -1, 3}), turn({3, -1, -3}), turn({-3, -1, -3})}}}, ground);
  const Settings settings = light_settings(IntegratorKind::path, 32, static_cast<std::uint32_t>(effort(32, 512)), 4);
  return render_image(b.build(), PerspectiveCamera{{turn({1, 2, 4}), turn({0, 0, 0}), turn({0, 1, 0})}, 0.7F}, settings)
      .pixels;
}

constexpr std::array<double, 9> kUnturned{1, 0, 0, 0, 1, 0, 0, 0, 1};

std::array<double, 9> a_turn(double angle, double tilt) {
  const double c = std::cos(angle), s = std::sin(angle), ct = std::cos(tilt), st = std::sin(tilt);
  return {c, 0, s, s * st, ct, -c * st, -s * ct, st, c * ct};
}

TEST(LightClosedForms, TurningMapAndSceneTogetherChangesNothing_Stress67) {
  const Material mirror{.surface = Conductor{{0.2F, 0.9F, 1.1F}, {3.9F, 2.4F, 2.2F}}};
  for (const auto& [angle, tilt] : {std::pair{1.1, 0.0}, {kPi, 0.3}, {-2.0, 1.5}}) {
    const Pixels a = turned(kUnturned, Material{.surface = Diffuse{grey(0.7F)}});
    const Pixels b = turned(a_turn(angle, tilt), Material{.surface = Diffuse{grey(0.7F)}});
    // Pixel by pixel, so that what varies over the image doesn't hide what differs.
    for (float Rgb::*channel : {&Rgb::r, &Rgb::g, &Rgb::b}) {
      Moments difference;
      for (std::size_t i = 0; i < a.color.size(); ++i)
        difference.add(double{a.color[i].*channel} - b.color[i].*channel);
      EXPECT_GT(t_test(difference, 0), sidak(0.01, 9)) << angle << ", " << tilt;
    }
  }
  // What a mirror shows of the sky takes no chance: it is the same but for rounding.
  const Pixels a = turned(kUnturned, mirror), b = turned(a_turn(1.1, 0.4), mirror);
  int alike = 0;
  for (std::size_t i = 0; i < a.color.size(); ++i) alike += std::abs(a.color[i].b - b.color[i].b) < 1e-4F;
  EXPECT_GT(alike, 100);
}

/// A ball in a sky with a lamp, and how bright it is on the whole.
Moments ball(const Surface& surface) {
  SceneBuilder b;
  b.material(Material{.surface = surface});
  const auto lamp = b.material(Material{.surface = Diffuse{{}}, .emission = {9, 9, 9}});
  b.light(EnvironmentLight{.map = sky_map()}).add(Sphere{{0, 0, 0}, 1}).add(Sphere{{2, 2, 2}, 0.7F}, lamp);
  return moments_of(
      render_image(b.build(), PerspectiveCamera{{{0, 0.5F, 4}, {0, 0, 0}, {0, 1, 0}}, 0.4F},
                   light_settings(IntegratorKind::path, 32, static_cast<std::uint32_t>(effort(48, 1024)), 8))
          .pixels);
}

TEST(LightClosedForms, RoughSurfacesTendToSmoothOnes_Stress76) {
  std::vector<std::pair<const char*, std::function<Surface(float)>>> kinds{
      {"conductor",
       [](float r) {
         return Conductor{{0.2F, 0.9F, 1.1F}, {3.9F, 2.4F, 2.2F}, r};
       }},
      {"dielectric",
       [](float r) {
         return Dielectric{1.5F, r};
       }},
      {"dense",
       [](float r) {
         return Dielectric{2.4F, r, {0.5F, 0.7F, 0.9F}};
       }},
      {"metal",
       [](float r) {
         return MetallicRoughness{{0.9F, 0.6F, 0.3F}, 1, r};
       }},
      {"plastic", [](float r) {
         return MetallicRoughness{{0.9F, 0.6F, 0.3F}, 0, r};
       }}};
  for (const auto& [name, surface] : kinds) {
    const double smooth = ball(surface(0)).mean();
    double before = smooth;
    for (const float roughness : {1e-6F, 1e-4F, 1e-3F, 3e-3F, 0.01F, 0.02F, 0.03F, 0.05F}) {
      const double rough = ball(surface(roughness)).mean();
      if (roughness <= 1e-3F) {
        EXPECT_NEAR(rough, smooth, 0.01 * smooth) << name << ", roughness " << roughness;
      }
      EXPECT_NEAR(rough, before, 0.01 * smooth) << "a gap: " << name << ", roughness " << roughness;
      before = rough;
    }
  }
}

/// A wide slab from z = 0 down to -thickness.
void add_slab(SceneBuilder& b, std::uint32_t material, float thickness) {
  b.add(horizontal(50, 0), material).add(horizontal(50, -thickness, false), material);
}

/// Beer's law: even light around a slab, of which some is mirrored in front, some behind, back and forth.
TEST(LightClosedForms, WhatASlabAbsorbs) {
  const Rgb absorption{0.5F, 2, 0};
  const float thickness = 0.75F;
  for (const float ior : {1.0F, 1.5F, 2.4F})
    for (const bool layered : {false, true}) {
      SceneBuilder b;
      const Surface glass =
          layered ? Surface(Layered{.metallic = 0, .roughness = 0, .ior = ior, .transmission = 1, .thin = false})
                  : Surface(Dielectric{ior});
      add_slab(b, b.material(Material{.surface = glass, .absorption = absorption}), thickness);
      b.background({1, 1, 1});
      const Image image =
          render_image(b.build(), down_at(0.1F, 0.2F),
                       light_settings(IntegratorKind::path, 32, static_cast<std::uint32_t>(effort(16, 256)), 32));
      const double f = std::pow((ior - 1.0) / (ior + 1.0), 2);
      for (float Rgb::*channel : {&Rgb::r, &Rgb::g, &Rgb::b}) {
        const double t = std::exp(-double{absorption.*channel} * thickness);
        const double due = f + (1 - f) * (1 - f) * t * (1 + f * t) / (1 - f * f * t * t);
        const Moments mean = moments_of(image.pixels, channel);
        EXPECT_NEAR(mean.mean(), due, 1e-5 + 4 * mean.standard_error()) << ior << ' ' << layered;
      }
    }
}

/// Of the same index as what is around, seen aslant, with sheets in it: the way inside is what counts.
TEST(LightClosedForms, WhatASlabAbsorbsAlongAnySlantAndThroughSheets) {
  const double way = 0.5 * std::sqrt(1 + 0.25);
  for (const bool with_sheets : {false, true}) {
    SceneBuilder b;
    add_slab(b, b.material(Material{.surface = Dielectric{1}, .absorption = {1, 2, 3}}), 0.5F);
    b.background({1, 1, 1});
    if (with_sheets) {
      b.add(horizontal(50, -0.125F), b.material(Material{.surface = Diffuse{}, .alpha = 0}));
      b.add(
          horizontal(50, -0.25F),
          b.material(Material{
              .surface = Layered{
                  .base_color = {0.5F, 0.5F, 0.5F}, .metallic = 0, .roughness = 0, .specular = 0, .transmission = 1}}));
    }
    const Camera camera = OrthographicCamera{{{0.5F, 0, 1}, {0, 0, 0}, {0, 1, 0}}, 1e-3F};
    const Image image = render_image(b.build(), camera, light_settings(IntegratorKind::path, 8, 4));
    for (const Rgb& c : image.pixels.color) {
      const double sheets = with_sheets ? 0.5 : 1;
      EXPECT_NEAR(c.r, sheets * std::exp(-way), 1e-5);
      EXPECT_NEAR(c.g, sheets * std::exp(-2 * way), 1e-5);
      EXPECT_NEAR(c.b, sheets * std::exp(-3 * way), 1e-5);
    }
  }
}

/// A floor in a slab, lit by a lamp in it: on the way there it is absorbed, too.
TEST(LightClosedForms, WhatIsAbsorbedOnTheWayFromALamp) {
  SceneBuilder b;
  add_slab(b, b.material(Material{.surface = Dielectric{1}, .absorption = {1, 1, 1}}), 1);
  b.add(horizontal(50, -0.75F), b.material(Material{.surface = Diffuse{grey(0.5F)}}));
  b.light(PointLight{{0, 0, -0.25F}, {2, 2, 2}});
  const Image image = render_image(b.build(), down_at(0.001F, 0.001F), light_settings(IntegratorKind::path, 8, 1, 3));
  for (const Rgb& c : image.pixels.color) EXPECT_NEAR(c.g, 0.5 / kPi * 2 / 0.25 * std::exp(-0.75 - 0.5), 1e-3);
}

/// Its colour is what is seen, straight, mirrored and through its own holes, with light and without.
TEST(LightClosedForms, WhatIsUnlitShowsItsColour) {
  const Rgb color{0.25F, 0.5F, 2};
  for (const bool with_light : {false, true})
    for (const IntegratorKind integrator : {IntegratorKind::automatic, IntegratorKind::direct})
      for (const bool faces : {true, false})
        for (const float alpha : {1.0F, 0.25F}) {
          SceneBuilder b;
          b.add(horizontal(5, 0, faces), b.material(Material{.surface = Unlit{color}, .alpha = alpha}));
          b.add(horizontal(0.2F, 0.5F, false),
                b.material(Material{.surface = Conductor{{1, 1, 1}, {1e4F, 1e4F, 1e4F}}}));
          if (with_light) b.light(PointLight{{0, 0, 3}, {9, 9, 9}});
          const auto scene = b.build();
          for (const std::uint32_t depth : {1U, 2U}) {
            if (depth == 1 && integrator == IntegratorKind::direct) continue;
            Settings settings = light_settings(integrator, 4, 4);
            if (integrator == IntegratorKind::automatic) settings.max_depth = depth;
            settings.aovs = {Aov::albedo};
            const Image straight = render_image(scene, down_at(1, 1), settings);
            for (const Rgb& c : straight.pixels.color) EXPECT_EQ(c, color * alpha);
            for (const Rgb& c : straight.pixels.plane<Rgb>(Aov::albedo)) EXPECT_EQ(c.b, color.b);
            if (depth == 1) continue;
            const Camera up = OrthographicCamera{{{0.1F, 0, 0.25F}, {0.1F, 0, 1}, {0, 1, 0}}, 1e-3F};
            for (const Rgb& c : render_image(scene, up, settings).pixels.color) EXPECT_NEAR(c.b, color.b * alpha, 1e-3);
          }
        }
}

}  // namespace
}  // namespace tessera
