#include "proto/import/nff.h"

#include <cmath>
#include <numbers>
#include <stop_token>

#include <gtest/gtest.h>

#include "proto/import/broken_file.h"

namespace tessera::proto {
namespace {

Imported read(std::string_view text) { return import_nff(text, "a.nff"); }

/// The one error of a broken text as "pointer: detail"; empty when it could be read.
std::string error_of(std::string_view text) {
  try {
    read(text);
  } catch (const BrokenFile& broken) {
    EXPECT_EQ(broken.errors.size(), 1U);
    return broken.errors.front().pointer + ": " + broken.errors.front().detail;
  }
  return "";
}

template <typename T>
const T& shape(const Imported& file, std::size_t i) {
  return std::get<T>(file.parts.at(i).shape);
}

constexpr std::string_view kView = "v\nfrom 2 1 1\nat 0 0 0\nup 0 0 1\nangle 45\nhither 0.01\nresolution 512 512\n";

TEST(Nff, ViewSpansTheCentresOfTheOuterRows) {
  const Imported file = read(kView);
  const auto& camera = std::get<PerspectiveCamera>(file.cameras.at(0).camera);
  EXPECT_EQ(camera.view.from, (Vec3{2, 1, 1}));
  EXPECT_EQ(camera.view.at, Vec3{});
  EXPECT_EQ(camera.view.up, (Vec3{0, 0, 1}));
  const double half = std::tan(22.5 * std::numbers::pi / 180) * 512 / 511;
  EXPECT_FLOAT_EQ(camera.vertical_fov, static_cast<float>(2 * std::atan(half)));
}

TEST(Nff, ViewTakesItsHeightFromTheFile) {
  const Imported file = read("v from 0 0 1 at 0 0 0 up 0 1 0 angle 90 hither 1 resolution 9 3");
  EXPECT_FLOAT_EQ(std::get<PerspectiveCamera>(file.cameras.at(0).camera).vertical_fov,
                  static_cast<float>(2 * std::atan(1.5)));
}

TEST(Nff, ResolutionIsTheImagesSize) {
  EXPECT_EQ(read(kView).image, (ImageSize{512, 512}));
  const std::string view = "v from 0 0 1 at 0 0 0 up 0 1 0 angle 90 hither 1 ";
  EXPECT_EQ(read(view + "resolution 640 480").image, (ImageSize{640, 480}));
  EXPECT_EQ(read(view).image, std::nullopt);
  for (const char* none :
       {"resolution 0 9", "resolution -4 9", "resolution 2.5 9", "resolution nan 9", "resolution 1e9 9"}) {
    const Imported file = read(view + none + "\ns 0 0 0 1");
    EXPECT_EQ(file.image, std::nullopt) << none;
    ASSERT_EQ(file.warnings.size(), 1U) << none;
    EXPECT_EQ(file.warnings[0].pointer, "a.nff:1");
  }
}

TEST(Nff, WhatASecondOneReplacesIsTold) {
  const Imported file = read("b 1 1 1\nb 0 0 0\ns 0 0 0 1");
  EXPECT_EQ(file.background, Rgb{});
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_EQ(file.warnings[0].pointer, "a.nff:2");
}

TEST(Nff, NothingIsQuotedOfAFileThatMayBeAnything) {
  for (const char* text : {"hunter2=1", "b hunter2 0 0", "v from hunter2", "p hunter2", "f 1 1 1 hunter2",
                           "l 1 2 hunter2", "f 1 1 1 1 1 1 0 1 hunter2", "s 0 0 0 1 hunter2", "v hunter2 1 2"}) {
    const std::string error = error_of(text);
    EXPECT_EQ(error.find("hunter2"), std::string::npos) << error;
    if (!error.empty()) continue;
    for (const SceneWarning& warning : read(text).warnings) {
      EXPECT_EQ(warning.detail.find("hunter2"), std::string::npos) << warning.detail;
    }
  }
}

TEST(Nff, ViewThatIsNoView) {
  const std::string start = "# a comment\nv\nfrom 2 1 1\n";
  EXPECT_EQ(error_of(start + "at 0 0 0\nangle 45"), "a.nff:2: A view needs from, at, up and angle");
  EXPECT_NE(error_of(start + "at 2 1 1\nup 0 0 1\nangle 45"), "");
  EXPECT_NE(error_of(start + "at 0 0 0\nup 4 2 2\nangle 45"), "");
  EXPECT_NE(error_of(start + "at 0 0 0\nup 0 0 0\nangle 45"), "");
  EXPECT_NE(error_of(start + "at nan 0 0\nup 0 0 1\nangle 45"), "");
  EXPECT_NE(error_of(start + "at 0 0 0\nup 0 0 1\nangle 180"), "");
  EXPECT_NE(error_of(start + "at 0 0 0\nup 0 0 1\nangle nan"), "");
  EXPECT_EQ(error_of(start + "at 0 0 0\nup 0 0 1\nangle 4,5"), "a.nff:6: A number is expected here");
}

TEST(Nff, BackgroundIsADisplayColour) {
  const Rgb background = read("b 0.5 0 1").background.value();
  EXPECT_NEAR(background.r, 0.2140411F, 1e-6);
  EXPECT_EQ(background.g, 0);
  EXPECT_EQ(background.b, 1);
  EXPECT_EQ(read("").background, std::nullopt);
  EXPECT_NE(error_of("b 0.5 -1 1"), "");
  EXPECT_NE(error_of("b 0.5 inf 1"), "");
}

TEST(Nff, LightsShareAUsefulIntensity) {
  const Imported file = read("l 1 2 3\nl 4 5 6 0.5 0.25 0\nl 7 8 9 # 1 1 1\nl 0 0 0");
  ASSERT_EQ(file.lights.size(), 4U);
  const auto& first = std::get<PointLight>(file.lights[0]);
  EXPECT_EQ(first.position, (Vec3{1, 2, 3}));
  EXPECT_FALSE(first.falls_off);
  EXPECT_FLOAT_EQ(first.intensity.g, std::numbers::pi_v<float> / 2);
  EXPECT_FLOAT_EQ(std::get<PointLight>(file.lights[1]).intensity.r, std::numbers::pi_v<float> / 2);
  EXPECT_FLOAT_EQ(std::get<PointLight>(file.lights[1]).intensity.g, std::numbers::pi_v<float> / 4);
  EXPECT_EQ(std::get<PointLight>(file.lights[1]).intensity.b, 0);
  EXPECT_TRUE(read("").lights.empty());
}

TEST(Nff, FillsBecomeMaterials) {
  const Imported file = read("f 1 0.5 0 0.8 0.3 12 0 0\nf 1 1 1 0 0 0 0.8 1.5\nf 1 1 1 0 0.1 0 0.8 1.5\ns 0 0 0 1");
  ASSERT_EQ(file.materials.size(), 3U);
  const auto& shiny = std::get<WhittedSurface>(file.materials[0].surface);
  // Values of the sRGB curve (IEC 61966-2-1) at 0.8, 0.4, 0.3, 0.2 and 0.1.
  EXPECT_NEAR(shiny.diffuse.r, 0.603827F, 1e-6);
  EXPECT_NEAR(shiny.diffuse.g, 0.132868F, 1e-6);
  EXPECT_NEAR(shiny.specular.g, 0.073239F, 1e-6);
  EXPECT_NEAR(shiny.reflect.b, 0.073239F, 1e-6);
  EXPECT_EQ(shiny.shininess, 12);
  EXPECT_TRUE(shiny.transmit.is_black());
  EXPECT_EQ(shiny.ior, 1) << "an index of 0 means nothing where nothing is transmitted";
  const auto& glass = std::get<WhittedSurface>(file.materials[1].surface);
  EXPECT_NEAR(glass.transmit.r, 0.603827F, 1e-6);
  EXPECT_NEAR(glass.reflect.r, 0.033105F, 1e-6);
  EXPECT_EQ(glass.ior, 1.5F);
  EXPECT_FALSE(glass.fresnel);
  EXPECT_NEAR(std::get<WhittedSurface>(file.materials[2].surface).reflect.r, 0.010023F, 1e-6);
  EXPECT_EQ(file.parts.at(0).material, 2U);
}

TEST(Nff, FillThatIsNone) {
  EXPECT_EQ(error_of("f 1 0 0\ns 0 0 0 1"), "a.nff:2: A number is expected here");
  EXPECT_NE(error_of("f 1 1 1 1 1 1 0.5 0"), "") << "transmits without an index";
  EXPECT_NE(error_of("f 1 1 1 -1 1 1 0 0"), "");
  EXPECT_NE(error_of("f 1 1 1 1 1 nan 0 0"), "");
  EXPECT_EQ(error_of("f 1e30 1 1 1 1 1 0 0"), "a.nff:1: Red must be a number from 0 to 1000");
  const Imported textured = read("f 1 1 1 1 1 1 0 1 earth map.jpg\ns 0 0 0 1");
  EXPECT_EQ(textured.parts.size(), 1U);
  ASSERT_EQ(textured.warnings.size(), 1U);
  EXPECT_EQ(textured.warnings[0].pointer, "a.nff:1");
}

TEST(Nff, EntitiesBeforeAnyFillHaveNoMaterial) { EXPECT_EQ(read("s 0 0 0 1").parts.at(0).material, std::nullopt); }

TEST(Nff, SpheresCylindersAndCones) {
  const Imported file = read("s 1 2 3 4\nc\n0 0 0 2\n0 0 5 2\nc 0 0 0 2 0 0 5 1\nc 0 0 0 1\n0 0 5 0");
  ASSERT_EQ(file.parts.size(), 4U);
  EXPECT_EQ(shape<Sphere>(file, 0).center, (Vec3{1, 2, 3}));
  EXPECT_EQ(shape<Sphere>(file, 0).radius, 4);
  EXPECT_EQ(shape<Cylinder>(file, 1).radius, 2);
  EXPECT_EQ(shape<Cylinder>(file, 1).apex, (Vec3{0, 0, 5}));
  EXPECT_EQ(shape<Cone>(file, 2).base_radius, 2);
  EXPECT_EQ(shape<Cone>(file, 2).apex_radius, 1);
  EXPECT_EQ(shape<Cone>(file, 3).apex_radius, 0);
  EXPECT_TRUE(file.warnings.empty());
}

TEST(Nff, NegativeRadiiCountAsPositive) {
  const Imported file = read("s 0 0 0 -2\nc 0 0 0 -2 0 0 5 -1\nc 0 0 0 -1 0 0 5 0");
  ASSERT_EQ(file.parts.size(), 3U);
  EXPECT_EQ(shape<Sphere>(file, 0).radius, 2);
  EXPECT_EQ(shape<Cone>(file, 1).base_radius, 2);
  EXPECT_EQ(shape<Cone>(file, 2).base_radius, 1);
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_NE(file.warnings[0].detail.find("(3 times)"), std::string::npos) << file.warnings[0].detail;
}

TEST(Nff, DegenerateEntitiesAreDroppedAndCounted) {
  const Imported file = read(
      "s 0 0 0 0\ns 0 0 nan 1\ns 0 0 0 inf\ns 1e30 0 0 1\n"
      "c 0 0 0 1 0 0 0 1\nc 0 0 0 0 0 0 1 0\nc 0 0 0 1 0 0 1 -1\nc 0 0 0 nan 0 0 1 1\n"
      "p 0\np 2\n0 0 0\n1 0 0\np 3\n0 0 0\n1 1 1\n2 2 2\npp 3\n0 0 nan 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n");
  EXPECT_TRUE(file.parts.empty());
  ASSERT_EQ(file.warnings.size(), 6U);
  EXPECT_EQ(file.warnings[0].pointer, "a.nff:1");
  EXPECT_NE(file.warnings[0].detail.find("sphere"), std::string::npos);
  EXPECT_NE(file.warnings[0].detail.find("(4 times)"), std::string::npos);
  EXPECT_EQ(file.warnings[1].pointer, "a.nff:5");
  EXPECT_NE(file.warnings[1].detail.find("(4 times)"), std::string::npos);
  EXPECT_NE(file.warnings[2].detail.find("less than 3"), std::string::npos);
  EXPECT_NE(file.warnings[3].detail.find("without area"), std::string::npos);
  EXPECT_NE(file.warnings[4].detail.find("NaN"), std::string::npos);
  EXPECT_NE(file.warnings[5].detail.find("no geometry"), std::string::npos);
}

constexpr std::string_view kTriangle = "p 3\n0 0 0\n1 0 0\n0 1 0\n";
constexpr std::string_view kPatch = "pp 3\n0 0 1 0 1 2\n1 0 1 0 1 2\n0 1 1 0 1 2\n";

TEST(Nff, NeighbouringPolygonsOfOneFillMakeOneMesh) {
  const std::string triangle(kTriangle);
  const std::string fill = "f 1 1 1 1 1 1 0 1\n";
  const Imported file =
      read(triangle + "# a comment\n" + triangle + fill + triangle + "s 0 0 0 1\n" + triangle + "p 0\n" + triangle);
  ASSERT_EQ(file.parts.size(), 4U);
  EXPECT_EQ(shape<TriangleMesh>(file, 0).triangles.size(), 2U);
  EXPECT_EQ(file.parts[0].material, std::nullopt);
  EXPECT_EQ(shape<TriangleMesh>(file, 1).triangles.size(), 1U);
  EXPECT_EQ(file.parts[1].material, 0U);
  EXPECT_EQ(shape<TriangleMesh>(file, 3).triangles.size(), 2U);
  EXPECT_TRUE(shape<TriangleMesh>(file, 0).normals.empty());
}

TEST(Nff, FlatPolygonsAmongPatchesGetTheirFacesNormal) {
  const Imported file = read(std::string(kTriangle) + std::string(kPatch));
  ASSERT_EQ(file.parts.size(), 1U);
  const auto& mesh = shape<TriangleMesh>(file, 0);
  ASSERT_EQ(mesh.normals.size(), 6U);
  EXPECT_EQ(mesh.normals[0], (Vec3{0, 0, 1}));
  EXPECT_EQ(mesh.normals[5], (Vec3{0, 1, 2}));
  EXPECT_EQ(mesh.triangles[1], (TriangleIndices{3, 4, 5}));
}

TEST(Nff, PatchNormalsWithoutDirectionAreReplaced) {
  const Imported file = read("pp 3\n0 0 0 0 0 0\n0 1 0 nan 0 1\n1 0 0 0 1 1");
  const auto& mesh = shape<TriangleMesh>(file, 0);
  EXPECT_EQ(mesh.normals[0], (Vec3{0, 0, -1}));
  EXPECT_EQ(mesh.normals[1], (Vec3{0, 0, -1}));
  EXPECT_EQ(mesh.normals[2], (Vec3{0, 1, 1}));
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_NE(file.warnings[0].detail.find("(2 times)"), std::string::npos);
}

TEST(Nff, StopsWhenNobodyWantsIt) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(import_nff("s 0 0 0 1\n", "a.nff", stop.get_token()), Abandoned);
}

TEST(Nff, ConcavePolygonsKeepTheirArea) {
  const Imported file = read("p 4\n0 0 0\n2 -2 0\n0 4 0\n-2 -2 0\n");
  const auto& mesh = shape<TriangleMesh>(file, 0);
  ASSERT_EQ(mesh.triangles.size(), 2U);
  for (const TriangleIndices& t : mesh.triangles) {
    EXPECT_GT(cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]]).z, 0);
  }
}

TEST(Nff, WhatIsNoNffIsRefusedWithItsLine) {
  EXPECT_EQ(error_of("b 0 0 0\n\ntet 0 0 0 5"),
            "a.nff:3: This is no NFF entity: one of v b l f c s p pp # is expected here");
  EXPECT_EQ(error_of("s 0 0 0"), "a.nff:1: The file ends where a number is expected");
  EXPECT_EQ(error_of("s 0 0 0 1\r\ns 0 0 0x1 1"), "a.nff:2: A number is expected here");
  EXPECT_NE(error_of("s 1 -15 2 4 8 8"), "");
  EXPECT_NE(error_of("p -3\n0 0 0"), "");
  EXPECT_NE(error_of("p 3.0\n0 0 0\n1 0 0\n0 1 0"), "");
  EXPECT_EQ(error_of("p 4000000000\n0 0 0\n"), "a.nff:3: The file ends where a number is expected");
  EXPECT_NE(error_of("p 99999999999\n0 0 0\n"), "");
  EXPECT_NE(error_of("p"), "");
  EXPECT_NE(error_of("l 1 2"), "");
  EXPECT_NE(error_of("l 1 2 3 1 1\ns 0 0 0 1"), "");
  EXPECT_NE(error_of(std::string_view("s 0 0\0 0 1", 11)), "");
}

TEST(Nff, AnEmptyFileIsAnEmptySceneWithAWarning) {
  const Imported file = read("# nothing\n");
  EXPECT_TRUE(file.parts.empty());
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_EQ(file.warnings[0].pointer, "a.nff");
}

}  // namespace
}  // namespace tessera::proto
