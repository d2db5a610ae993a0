#include "proto/import/obj.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "proto/import/broken_file.h"
#include "proto/import/mtl.h"
#include "proto/import/polygon.h"

namespace tessera::proto {
namespace {

namespace fs = std::filesystem;
using Triangles = std::vector<TriangleIndices>;

Imported read_obj(std::string_view text) { return import_obj(std::string(text), "a.obj", nullptr); }

std::vector<std::string> errors_of(std::string_view text) {
  std::vector<std::string> errors;
  try {
    read_obj(text);
  } catch (const BrokenFile& broken) {
    for (const FieldError& error : broken.errors) errors.push_back(error.pointer + ": " + error.detail);
  }
  return errors;
}
std::string obj_error_of(std::string_view text) {
  const std::vector<std::string> errors = errors_of(text);
  return errors.size() == 1 ? errors[0] : std::to_string(errors.size()) + " errors";
}

const TriangleMesh& mesh(const Imported& file, std::size_t part = 0) {
  return std::get<TriangleMesh>(file.parts.at(part).shape);
}

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(Obj, PositionsAndFaces) {
  const Imported file = read_obj("# a square\n" + kSquare + "f 1 2 3\nf -4 -2 -1\n");
  ASSERT_EQ(file.parts.size(), 1U);
  EXPECT_EQ(mesh(file).positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh(file).triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_TRUE(mesh(file).normals.empty());
  EXPECT_EQ(file.parts[0].material, std::nullopt);
  EXPECT_TRUE(file.warnings.empty());
}

TEST(Obj, PolygonsAreTiled) {
  const Imported file = read_obj("v 0 0 0\nv 2 -2 0\nv 0 4 0\nv -2 -2 0\nf 2 3 4 1\nf 1 2 3 4\n");
  double area = 0;
  for (const TriangleIndices& t : mesh(file).triangles) area += std::abs(area_vector(mesh(file).positions, t).z);
  EXPECT_EQ(mesh(file).triangles.size(), 4U);
  EXPECT_DOUBLE_EQ(area, 32);
}

TEST(Obj, NormalsWhereEveryCornerHasOne) {
  const std::string normals = "vn 0 0 1\nvn 0 1 1\nvt 0 0\n";
  const Imported with = read_obj(kSquare + normals + "f 1//1 2//1 3//1\nf 1/1/2 3/1/1 4/1/-1\n");
  EXPECT_EQ(mesh(with).positions.size(), 5U) << "the first corner has two normals, so it is two vertices";
  EXPECT_EQ(mesh(with).triangles, (Triangles{{0, 1, 2}, {3, 2, 4}}));
  EXPECT_EQ(mesh(with).normals[0], (Vec3{0, 0, 1}));
  EXPECT_EQ(mesh(with).normals[3], (Vec3{0, 1, 1}));
  EXPECT_EQ(mesh(with).positions[3], Vec3{});

  const Imported without = read_obj(kSquare + normals + "f 1/1 2/1 3/1\nf 1/1 3/1 4/1\n");
  EXPECT_TRUE(mesh(without).normals.empty());
  EXPECT_EQ(mesh(without).positions.size(), 4U);
}

TEST(Obj, ManyNormalsAtOnePositionTakeNoTimeInTheirSquare) {
  std::string text = kSquare;
  for (int i = 1; i <= 50'000; ++i)
    text += "vn 0 " + std::to_string(i) + " 1\nf 1//" + std::to_string(i) + " 2//1 3//1\n";
  EXPECT_EQ(mesh(read_obj(text)).triangles.size(), 50'000U);
}

TEST(Obj, APartForEachObjectGroupAndMaterial) {
  const Imported file =
      read_obj(kSquare +
               "f 1 2 3\no one\nf 1 2 3\ng a b\nf 1 2 3\nusemtl red\nf 1 2 3\nusemtl green\nf 1 2 3\n"
               "usemtl red\nf 2 3 4\ng\nf 1 2 3\no two\nusemtl red\nf 1 2 3\no one\ng a b\nf 1 2 4\n");
  std::vector<std::size_t> sizes;
  for (const ImportedPart& part : file.parts) sizes.push_back(std::get<TriangleMesh>(part.shape).triangles.size());
  EXPECT_EQ(sizes, (std::vector<std::size_t>{1, 1, 1, 3, 1, 1, 1}));
}

TEST(Obj, FacesMayNameWhatComesLater) {
  EXPECT_EQ(mesh(read_obj("f 1//1 2//1 3//1\n" + kSquare + "vn 0 0 1\n")).normals.size(), 3U);
}

TEST(Obj, LinesMayEndAsOnAnySystemBeContinuedAndHaveComments) {
  const Imported hash = read_obj(kSquare + "f 1 2 3 4 # both\nv 5 5 5#\nv 6 6 6 #\n");
  ASSERT_EQ(hash.warnings.size(), 1U) << "5# is no number";
  EXPECT_EQ(hash.warnings[0].pointer, "a.obj:6");
  const std::string good = kSquare + "f 1 2 3 4\t# both\n";
  std::string windows, mac = good;
  for (const char c : good) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  std::replace(mac.begin(), mac.end(), '\n', '\r');
  for (const std::string& form : {good, windows, mac, "\xEF\xBB\xBF" + good, good.substr(0, good.size() - 1)}) {
    EXPECT_EQ(mesh(read_obj(form)).triangles.size(), 2U);
    EXPECT_TRUE(read_obj(form).warnings.empty());
  }
  const std::string split = kSquare + "# no \\\nf 1 \\\n 2 \\ \t\n3 \\\r\n4\nf 1 2\n";
  EXPECT_EQ(mesh(read_obj(split)).triangles.size(), 2U);
  ASSERT_EQ(read_obj(split).warnings.size(), 1U);
  EXPECT_EQ(read_obj(split).warnings[0].pointer, "a.obj:10") << "continued lines count";
}

TEST(Obj, NumbersInEveryForm) {
  const Imported file = read_obj("v 1. +.5 -1e+1\nv  1E0\t2 3\n  v 1e-60 0 0 \nf 1 2 3\n");
  EXPECT_EQ(mesh(file).positions, (std::vector<Vec3>{{1, 0.5F, -10}, {1, 2, 3}, {0, 0, 0}}));
}

TEST(Obj, AVertexThatIsNoneKeepsItsPlaceAndCostsItsFaces) {
  const Imported file = read_obj(kSquare + "v 0x1 0 0\nv 1 3.1+e2 0\nv 1 2\nv\nv 2 2 2\nvn 1 2 z\n" +
                                 "f 1 2 5\nf 1 2 6\nf 1 7 3\nf 8 2 3\nf 1 2 9\nf -9 2 3\n");
  EXPECT_EQ(mesh(file).triangles.size(), 2U);
  EXPECT_EQ(mesh(file).positions.back(), (Vec3{2, 2, 2}));
  ASSERT_EQ(file.warnings.size(), 3U);
  EXPECT_EQ(file.warnings[0].pointer, "a.obj:5");
  EXPECT_EQ(file.warnings[0].detail, "A vertex without three numbers costs the faces that use it (4 times)");
  EXPECT_EQ(file.warnings[1].pointer, "a.obj:10");
  EXPECT_NE(file.warnings[2].detail.find("was dropped (4 times)"), std::string::npos) << file.warnings[2].detail;
}

TEST(Obj, AFileOfWhichNothingIsLeftIsRefusedWithItsFirstErrors) {
  EXPECT_EQ(errors_of("v 0x1 0 0\nv 1 3.1+e2 0\n\nv 1 2\nv\nf 1 2 3\nf 1 2 x\n"),
            (std::vector<std::string>{
                "a.obj:1: A number is expected here", "a.obj:2: A number is expected here",
                "a.obj:4: Three numbers are expected here", "a.obj:5: Three numbers are expected here",
                "a.obj:7: A face's corners are written v, v/vt, v//vn or v/vt/vn, with whole numbers other than 0"}));
  const std::vector<std::string> degenerate = errors_of(kSquare + "f 1 1 1\nf 1 2\n");
  ASSERT_EQ(degenerate.size(), 3U);
  EXPECT_EQ(degenerate[0], "a.obj:6: A face with less than 3 corners was dropped");
  EXPECT_EQ(degenerate[1], "a.obj:5: A triangle with two corners in one place was dropped");
  EXPECT_EQ(degenerate[2], "a.obj: The file has no triangles");
  std::string many;
  for (int i = 0; i < 100; ++i) many += "f 1 2 3\n";
  EXPECT_EQ(errors_of(many).size(), kMaxFieldErrors);
}

TEST(Obj, TrianglesThatArentFiniteAreDroppedAndCounted) {
  const Imported file = read_obj(kSquare +
                                 "v nan 0 0\nv inf 0 0\nv 1e999 0 0\nv 1.#IND 0 0\n"
                                 "f 1 2 5\nf 1 2 6\nf 1 2 7\nf 1 2 8\nf 1 2 3\nf 1 2 2\nf 1 2\n");
  EXPECT_EQ(mesh(file).triangles.size(), 1U);
  ASSERT_EQ(file.warnings.size(), 3U);
  EXPECT_NE(file.warnings[1].detail.find("(4 times)"), std::string::npos);
}

TEST(Obj, AFaceWhoseCornersAreNoneIsDroppedAndCounted) {
  for (const char* face : {"1 2 x", "1 2 3a", "1/1/1/1 2 3", "/1 2 3", "1-2 2 3", "1 2 +", "1 2 4294967297", "1.5 2 3",
                           "1 2 3 \"", "//1 2 3", "1 2 3/x", "1//y 2 3"}) {
    const std::string bad = "f " + std::string(face) + '\n';
    const Imported file = read_obj(kSquare + "vt 0 0\nvn 0 0 1\n" + bad + "f 1 2 3 4\n" + bad);
    EXPECT_EQ(mesh(file).triangles.size(), 2U) << face;
    ASSERT_EQ(file.warnings.size(), 1U) << face;
    EXPECT_EQ(file.warnings[0].pointer, "a.obj:7");
    EXPECT_EQ(file.warnings[0].detail,
              "A face whose corners aren't written v, v/vt, v//vn or v/vt/vn was dropped (2 times)");
    EXPECT_TRUE(obj_error_of(kSquare + bad).starts_with("a.obj:5: A face's corners are written")) << face;
  }
  EXPECT_TRUE(read_obj(kSquare + "vt 0 0\nvn 0 0 1\nf +1/1/1 -3//+1\t3 \n").warnings.empty());
}

TEST(Obj, WhatFollowsASlashMayBeMissing) {
  for (const char* face : {"1// 2// 3//", "1/ 2/ 3/", "1/1/ 2/1/ 3/1/", "1 2/ 3//", "1/1 2// 3"}) {
    const Imported file = read_obj(kSquare + "vt 0 0\nf " + std::string(face) + '\n');
    EXPECT_EQ(mesh(file).triangles, (Triangles{{0, 1, 2}})) << face;
    EXPECT_TRUE(mesh(file).normals.empty());
    EXPECT_TRUE(file.warnings.empty()) << face;
  }
}

TEST(Obj, AnIndexThatNothingNeedsIsIgnoredAndTold) {
  for (const char* faces : {"f 1/7 2/7 3/7\n", "f 1/-1 2 3\n", "f 1/0 2 3\n", "f 1//0 2//0 3//0\n", "f 1//9 2 3\n",
                            "f 1//-1 2 3\n", "f 1/1/1 2/1/1 3/1/1\n"}) {
    const Imported file = read_obj(kSquare + faces);
    EXPECT_EQ(mesh(file).triangles, (Triangles{{0, 1, 2}})) << faces;
    EXPECT_TRUE(mesh(file).normals.empty());
    ASSERT_EQ(file.warnings.size(), 1U) << faces;
    EXPECT_EQ(file.warnings[0].pointer, "a.obj:5");
    EXPECT_TRUE(file.warnings[0].detail.starts_with("The index of a normal or a texture coordinate that isn't there"));
  }
  EXPECT_TRUE(read_obj("f 1/1 2/2 3/1\n" + kSquare + "vt 0 0\nvt 1 1\n").warnings.empty()) << "they come later";
}

TEST(Obj, AFaceThatNamesNoVertexIsDroppedAndCounted) {
  const Imported file = read_obj(kSquare + "f 1 2 5\nf 1 2 3\nf -5 1 2\nf 0 1 2\nf 1 2 999999999\nf 1 3 4\nf 9 9 9\n");
  EXPECT_EQ(mesh(file).triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_EQ(file.warnings[0].detail, "A face that names a vertex that isn't there was dropped (5 times)");

  EXPECT_EQ(errors_of(kSquare + "f 1 2 5\nf -5 1 2\nf 0 1 2\n"),
            (std::vector<std::string>{"a.obj:6: Vertex -5 is out of range: before this line there are 4",
                                      "a.obj:7: Vertex 0 is out of range: vertices are counted from 1",
                                      "a.obj:5: Vertex 5 is out of range: the file has 4"}));
}

TEST(Obj, NothingIsQuotedOfAFileThatMayBeAnything) {
  const std::string secret = "password=hunter2";
  for (const std::string& text :
       {secret + "\n", "v " + secret + "\nf 1 2 3\n", "f " + secret + "\n", "usemtl " + secret + "\nf 1 2 3\n",
        "vn " + secret + "\ns " + secret + "\ng " + secret + "\n" + secret}) {
    std::string said;
    for (const std::string& error : errors_of(text)) said += error;
    try {
      for (const SceneWarning& warning : read_obj(text).warnings) said += warning.pointer + warning.detail;
    } catch (const BrokenFile&) {
    }
    EXPECT_FALSE(said.empty());
    EXPECT_EQ(said.find("hunter2"), std::string::npos) << said;
  }
}

const std::string kRoof = "v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 1\nv 1 2 0\nv 0 2 0\n";  // Two slopes, a ridge at 3 4.
const Vec3 kFront = to_float(Vec3d{0, -std::numbers::sqrt2 / 2, std::numbers::sqrt2 / 2});
const Vec3 kBack{0, -kFront.y, kFront.z};

/// The mesh's normals, each with the place where it is.
std::map<std::array<float, 3>, std::vector<Vec3>> normals_at(const TriangleMesh& mesh) {
  std::map<std::array<float, 3>, std::vector<Vec3>> result;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    result[{mesh.positions[i].x, mesh.positions[i].y, mesh.positions[i].z}].push_back(mesh.normals.at(i));
  }
  return result;
}

TEST(Obj, FacesOfOneSmoothingGroupShareTheirNormals) {
  for (const char* on : {"s 1\n", "s on\n", "s 37\n"}) {
    const Imported file = read_obj(kRoof + on + "f 1 2 3 4\nf 4 3 5 6\n");
    const auto normals = normals_at(mesh(file));
    EXPECT_EQ(normals.at({1, 1, 1}), (std::vector<Vec3>{{0, 0, 1}})) << "the ridge, where slopes of one size meet";
    ASSERT_EQ(normals.at({0, 0, 0}).size(), 1U);
    EXPECT_FLOAT_EQ(normals.at({0, 0, 0})[0].y, kFront.y);
    EXPECT_TRUE(file.warnings.empty());
  }
}

TEST(Obj, FacesCountByTheirAngleRatherThanByTheirArea) {
  // Two rectangles of different sizes, whose exporter wrote the normals beside them (tinyobjloader's issue 29).
  const std::string squares = "v 0 2 0\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 4 0 -1.255298\nv 4 2 -1.255298\ns 1\n";
  for (const char* faces : {"f 1 2 3 4\nf 4 3 5 6\n", "f 1 2 3\nf 1 3 4\nf 4 3 5\nf 4 5 6\n"}) {
    const Vec3 ridge = normals_at(mesh(read_obj(squares + faces))).at({2, 0, 0}).at(0);
    EXPECT_NEAR(ridge.x, 0.276597, 1e-5);
    EXPECT_NEAR(ridge.y, 0, 1e-6);
    EXPECT_NEAR(ridge.z, 0.960986, 1e-5);
  }
}

TEST(Obj, SmoothingEndsAtItsGroup) {
  for (const char* off : {"s off\n", "s 0\n"}) {
    EXPECT_TRUE(mesh(read_obj(kRoof + off + "f 1 2 3 4\nf 4 3 5 6\n")).normals.empty()) << "flat";
  }
  for (const char* second : {"s 2\n", "s off\n"}) {
    const auto normals = normals_at(mesh(read_obj(kRoof + "s 1\nf 1 2 3 4\n" + second + "f 4 3 5 6\n")));
    ASSERT_EQ(normals.at({1, 1, 1}).size(), 2U);
    for (const Vec3 n : normals.at({1, 1, 1})) EXPECT_FLOAT_EQ(std::abs(n.y), kBack.y);
  }
}

TEST(Obj, BothSidesOfACardInOneSmoothingGroupAreFlat) {
  // Their normals add up to nothing, or to what rounding leaves of them.
  const std::string cards = "v 0 0 0\nv 1 0 0\nv 1 0.3 1\nv 0 0.3 1\nv 2 0.7 0.1\nv 2 0.9 1.1\ns 1\n";
  const Imported file = read_obj(cards + "f 1 2 3 4\nf 4 3 2 1\nf 2 5 6 3\nf 3 6 5 2\n");
  const TriangleMesh& card = mesh(file);
  for (const TriangleIndices& t : card.triangles) {
    const Vec3d area = area_vector(card.positions, t);
    for (const std::uint32_t corner : t) {
      if (card.normals.empty()) continue;  // flat as well
      EXPECT_GT(dot(to_double(card.normals[corner]), area), 0.999 * length(area) * length(card.normals[corner]));
    }
  }
}

TEST(Obj, LongNamesOfPartsAreKeptOnce) {
  const std::string name(100'000, 'n');
  std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\no " + name + "\n";
  for (int i = 0; i < 2000; ++i) text += "g " + std::to_string(i) + "\nf 1 2 3\n";  // 200 MB of names otherwise
  EXPECT_EQ(read_obj(text).parts.size(), 2000U);
}

TEST(Obj, SmoothingGoesAcrossObjectsGroupsAndMaterials) {
  const Imported file = read_obj(kRoof + "s 1\nf 1 2 3 4\ng other\nusemtl b\nf 4 3 5 6\n");
  ASSERT_EQ(file.parts.size(), 2U);
  EXPECT_EQ(normals_at(mesh(file, 0)).at({1, 1, 1}), (std::vector<Vec3>{{0, 0, 1}}));
  EXPECT_EQ(normals_at(mesh(file, 1)).at({1, 1, 1}), (std::vector<Vec3>{{0, 0, 1}}));
}

TEST(Obj, NormalsThatAreNamedWinOverSmoothing) {
  const auto normals = normals_at(mesh(read_obj(kRoof + "vn 1 0 0\ns 1\nf 1//1 2//1 3//1 4//1\nf 4 3 5 6\n")));
  EXPECT_EQ(normals.at({0, 0, 0}), (std::vector<Vec3>{{1, 0, 0}}));
  ASSERT_EQ(normals.at({1, 1, 1}).size(), 2U);
  EXPECT_EQ(normals.at({1, 1, 1})[0], (Vec3{1, 0, 0}));
  EXPECT_EQ(normals.at({1, 1, 1})[1], (Vec3{0, 0, 1})) << "the group's own";
  const auto mixed = normals_at(mesh(read_obj(kRoof + "vn 1 0 0\nf 1//1 2//1 3//1 4//1\nf 4 3 5 6\n")));
  EXPECT_FLOAT_EQ(mixed.at({1, 2, 0})[0].y, kBack.y) << "flat without a group";
}

TEST(Obj, ASmoothingGroupThatIsNoneIsTold) {
  const Imported file = read_obj(kRoof + "s x\nf 1 2 3 4\n");
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_EQ(file.warnings[0].pointer, "a.obj:7");
}

TEST(Obj, WhatIsNoText) {
  EXPECT_EQ(obj_error_of(std::string_view("\xFE\xFF\0v", 4)), "a.obj:1: The file is UTF-16: save it as UTF-8");
  EXPECT_EQ(obj_error_of(std::string_view("v 0 0 0\nv 1 0\0 0\n", 17)), "a.obj:2: A byte 0: this is no text");
}

TEST(Obj, IgnoredStatementsAreCounted) {
  const Imported file = read_obj(kSquare + "l 1 2\ns off\np 1\nf 1 2 3\nend\n");
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_EQ(file.warnings[0].pointer, "a.obj:5");
  EXPECT_NE(file.warnings[0].detail.find("(3 times)"), std::string::npos);
}

TEST(Obj, WithoutFacesThereIsNoPartButAWarning) {
  for (const std::string& text : {std::string(), kSquare}) {
    const Imported file = read_obj(text);
    EXPECT_TRUE(file.parts.empty());
    ASSERT_FALSE(file.warnings.empty());
    EXPECT_EQ(file.warnings.back().detail, "The file has no triangles");
  }
}

/// A folder with MTL libraries.
class ObjMaterials : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo& test = *testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("tessera_") + test.name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  Imported read_with(const std::string& statements) {
    return import_obj(kSquare + statements, "a.obj", [&](std::string_view name) -> std::optional<fs::path> {
      asked_.emplace_back(name);
      std::error_code error;  // Names may be longer than any file's.
      return fs::is_regular_file(folder_ / name, error) ? std::optional(folder_ / name) : std::nullopt;
    });
  }

  WhittedSurface material(const std::string& mtl) {
    write("m.mtl", "newmtl m\n" + mtl);
    const Imported file = read_with("mtllib m.mtl\nusemtl m\nf 1 2 3\n");
    warnings_ = file.warnings;
    return std::get<WhittedSurface>(file.materials.at(file.parts.at(0).material.value()).surface);
  }

  /// That the last material had one warning, with these words, at a line of the library.
  void expect_told(const std::string& words) {
    ASSERT_EQ(warnings_.size(), 1U) << words;
    EXPECT_NE(warnings_[0].detail.find(words), std::string::npos) << warnings_[0].detail;
    EXPECT_TRUE(warnings_[0].pointer.starts_with("m.mtl:")) << warnings_[0].pointer;
  }

  fs::path folder_;
  std::vector<SceneWarning> warnings_;  ///< Of the last `material`.
  std::vector<std::string> asked_;
};

TEST_F(ObjMaterials, MapOntoWhitted) {
  const WhittedSurface plain = material("Kd 0.1 0.2 0.3\nKs 0.4 0.5 0.6\nNs 20\nNi 1.5\nillum 2\n");
  EXPECT_EQ(plain.diffuse, (Rgb{0.1F, 0.2F, 0.3F}));
  EXPECT_EQ(plain.specular, (Rgb{0.4F, 0.5F, 0.6F}));
  EXPECT_EQ(plain.shininess, 20);
  EXPECT_TRUE(plain.reflect.is_black());
  EXPECT_TRUE(plain.transmit.is_black());
  EXPECT_EQ(plain.ior, 1);
  EXPECT_FALSE(plain.fresnel);

  EXPECT_TRUE(material("Ks 1 1 1\nillum 1\n").specular.is_black());
  EXPECT_EQ(material("Ks 1 0.5 0\nillum 3\n").reflect, (Rgb{1, 0.5F, 0}));

  const WhittedSurface glass = material("Kd 1 1 1\nKs 0.25 0.25 0.25\nd 0.25\nNi 1.5\nillum 7\n");
  EXPECT_EQ(glass.diffuse, (Rgb{0.25F, 0.25F, 0.25F}));
  EXPECT_EQ(glass.transmit, (Rgb{0.75F, 0.75F, 0.75F}));
  EXPECT_EQ(glass.reflect, (Rgb{0.25F, 0.25F, 0.25F}));
  EXPECT_EQ(glass.ior, 1.5F);
  EXPECT_TRUE(glass.fresnel);

  EXPECT_EQ(material("Tr 0.25\n").transmit, (Rgb{0.25F, 0.25F, 0.25F}));
  EXPECT_FALSE(material("Tr 0.25\nillum 6\nNi 1.3").fresnel);
  EXPECT_EQ(material("Tr 0.25\nillum 6\nNi 1.3").ior, 1.3F);
  for (const char* model : {"illum 4", "illum 9", "illum 2"}) {
    EXPECT_EQ(material(std::string("d 0.25\nNi 1.3\n") + model).ior, 1) << "refraction is on in 6 and 7 alone";
  }
  const WhittedSurface without_index = material("Ks 1 1 1\nillum 5\n");
  EXPECT_FALSE(without_index.fresnel) << "between equal media nothing would be mirrored";
  EXPECT_EQ(without_index.reflect, (Rgb{1, 1, 1}));
  EXPECT_TRUE(material("Ks 1 1 1\nNi 1.5\nillum 5\n").fresnel);
}

void expect_near(Rgb actual, Rgb expected, double slack = 1e-6) {
  EXPECT_NEAR(actual.r, expected.r, slack);
  EXPECT_NEAR(actual.g, expected.g, slack);
  EXPECT_NEAR(actual.b, expected.b, slack);
}

TEST_F(ObjMaterials, TakeColoursInEveryForm) {
  EXPECT_EQ(material("Kd 0.5\n").diffuse, (Rgb{0.5F, 0.5F, 0.5F}));
  EXPECT_TRUE(warnings_.empty());
  EXPECT_EQ(material("Ks 0.5 0.25\n").specular, (Rgb{0.5F, 0.25F, 0.5F}));
  expect_told("two numbers");
  EXPECT_EQ(material("kd 0.1 0.2 0.3\nKS 1\nNs 7\nns 8").diffuse, (Rgb{0.1F, 0.2F, 0.3F}));
  EXPECT_TRUE(warnings_.empty());
  // The matrix of IEC 61966-2-1: its rows' sums where x = y = z, its columns.
  expect_near(material("Kd xyz 0.5\n").diffuse, {0.60240F, 0.47420F, 0.45435F});
  EXPECT_TRUE(warnings_.empty());
  expect_near(material("Kd XYZ 0.475250 0.5 0.544550\n").diffuse, {0.5F, 0.5F, 0.5F},
              1e-4);  // D65, as far as the matrix has digits.
  EXPECT_EQ(material("Kd spectral ident.rfl 0.25\n").diffuse, (Rgb{0.25F, 0.25F, 0.25F}));
  expect_told("Spectral curves aren't read");
  EXPECT_EQ(material("Ks spectral my curve.rfl\n").specular, (Rgb{1, 1, 1}));
  EXPECT_EQ(material("Kd 255 0 0\n").diffuse, (Rgb{255, 0, 0}));
  expect_told("a component above 1");
  EXPECT_EQ(material("Kd -1 0 0.5\n").diffuse, (Rgb{0, 0, 0.5F}));
  expect_told("negative");
  EXPECT_EQ(material("Kd 0.5 0.5 0.5 0.5\n").diffuse, (Rgb{0.5F, 0.5F, 0.5F}));
  expect_told("What follows");
}

TEST_F(ObjMaterials, DissolveInEveryForm) {
  const auto through = [&](const std::string& d) { return material(d + "\nillum 2\n").transmit.r; };
  EXPECT_EQ(through("d 1"), 0);
  EXPECT_EQ(through("d 0.25"), 0.75F);
  EXPECT_EQ(through("Tr 0.25"), 0.25F);
  EXPECT_TRUE(warnings_.empty());
  EXPECT_EQ(through("d -halo 1.0"), 0) << "1 - (N.v)(1 - 1): opaque from everywhere";
  expect_told("-halo");
  EXPECT_FLOAT_EQ(through("d -halo 0"), 2.0F / 3) << "N.v is 2/3 on average over a ball's picture";
  EXPECT_FLOAT_EQ(through("d -halo 0.4"), 0.4F);
  EXPECT_EQ(through("d 0.25\nTr 0.25"), 0.75F);
  expect_told("Tr isn't 1 - d");
  EXPECT_EQ(through("d 7"), 0);
  expect_told("from 0 to 1");
}

TEST_F(ObjMaterials, TheFilterColoursWhatGoesThrough) {
  for (const char* model : {"6", "7"}) {
    expect_near(material(std::string("Ks 0.25\nTf 0 1 0.5\nNi 1.5\nillum ") + model).transmit, {0, 0.75F, 0.375F});
    EXPECT_TRUE(warnings_.empty()) << "(1 - Ks) Tf It";
    EXPECT_TRUE(material(std::string("Ks 0.25\nNi 1.5\nillum ") + model).transmit.is_black());
  }
  EXPECT_EQ(material("Tf 1 0 0\nd 0.25\nillum 4").transmit, (Rgb{0.75F, 0, 0}));
  expect_near(material("Tf 1 0 1\nKs 0.5\nd 0.25\nillum 6").transmit, {0.875F, 0, 0.875F});
  EXPECT_TRUE(warnings_.empty());
  for (const char* model : {"2", "4", "5", "9"}) {
    EXPECT_TRUE(material(std::string("Tf 1 0 0\nNi 1.5\nillum ") + model).transmit.is_black());
    expect_told("Tf without illum 6 or 7");
  }
}

TEST_F(ObjMaterials, StatementsWithoutAMeaningHereAreTold) {
  for (const char* statement : {"Ka 1 1 1", "Km 1", "sharpness 60", "aniso 0", "anisor 0", "map_aat on", "unheard of",
                                "illum 0", "illum 10", "illum 11", "illum 2.5", "Ni 0", "map_Ks a.png", "map_Ka a.png",
                                "map_Ns a.png", "map_new a.png", "REFL -type sphere a"}) {
    material(std::string(statement) + '\n' + statement + '\n');
    ASSERT_EQ(warnings_.size(), 1U) << statement;
    EXPECT_EQ(warnings_[0].pointer, "m.mtl:2");
    EXPECT_NE(warnings_[0].detail.find("(2 times)"), std::string::npos) << warnings_[0].detail;
  }
  write("m.mtl", "Kd 1 0 0\nnewmtl a\nKd 0 1 0\nnewmtl a\nKd 0 0 1\nnewmtl\n");
  const Imported file = read_with("mtllib m.mtl\nusemtl a\nf 1 2 3\n");
  ASSERT_EQ(file.materials.size(), 1U);
  EXPECT_EQ(std::get<WhittedSurface>(file.materials[0].surface).diffuse, (Rgb{0, 1, 0}));
  ASSERT_EQ(file.warnings.size(), 3U) << "one before, one again, one without a name";
}

TEST_F(ObjMaterials, NothingIsQuotedOfALibraryThatMayBeAnything) {
  for (const char* text : {"KEY=hunter2\n", "newmtl a\nhunter2 = 7\nd hunter2\nKd hunter2\nillum hunter2\n"}) {
    write("m.mtl", text);
    for (const SceneWarning& warning : read_with("mtllib m.mtl\nf 1 2 3\n").warnings) {
      EXPECT_EQ(warning.detail.find("hunter2"), std::string::npos) << warning.detail;
    }
  }
}

TEST_F(ObjMaterials, NumbersThatAreNoneCountAsZeroAndAreNamed) {
  write("m.mtl", "newmtl m\nKd nan 0.5 0x9\nKs -1 2 1e999\nNs -3\nNi -1\nd 7\nillum 7\n");
  const Imported file = read_with("mtllib m.mtl\nusemtl m\nf 1 2 3\n");
  EXPECT_EQ(std::get<WhittedSurface>(file.materials[0].surface).diffuse, (Rgb{0, 0.5F, 0}));
  EXPECT_EQ(std::get<WhittedSurface>(file.materials[0].surface).specular, (Rgb{0, 2, 0}));
  EXPECT_EQ(std::get<WhittedSurface>(file.materials[0].surface).shininess, 0);
  EXPECT_EQ(std::get<WhittedSurface>(file.materials[0].surface).ior, 1);
  EXPECT_TRUE(std::get<WhittedSurface>(file.materials[0].surface).transmit.is_black());
  const std::vector<std::string> told{"m.mtl:2: A number is missing, or isn't one, and counts as 0 (3 times)",
                                      "m.mtl:3: A colour has a component above 1, which is used as it is",
                                      "m.mtl:3: A negative number counts as 0 (2 times)",
                                      "m.mtl:5: An index of refraction that isn't above 0 was ignored",
                                      "m.mtl:6: A number beyond the range from 0 to 1 counts as its nearest end",
                                      "m.mtl:1: illum 5 or 7 without an Ni other than 1 reflects as 3 or 6"};
  ASSERT_EQ(file.warnings.size(), told.size());
  for (std::size_t i = 0; i < told.size(); ++i)
    EXPECT_EQ(file.warnings[i].pointer + ": " + file.warnings[i].detail, told[i]);
}

TEST_F(ObjMaterials, ComeFromSeveralLibrariesWhoseNamesMayHoldBlanks) {
  write("a.mtl", "newmtl a\nKd 1 0 0\n");
  write("sub/b c.mtl", "newmtl  b b \nKd 0 1 0\nnewmtl a\nKd 0 0 1\n");
  for (const char* libraries : {"mtllib a.mtl sub/b c.mtl\n", "mtllib a.mtl\nmtllib  sub\\b\\ c.mtl \n"}) {
    const Imported file = read_with(std::string("usemtl a \nf 1 2 3\nusemtl b b\nf 1 2 4\n") + libraries);
    ASSERT_EQ(file.parts.size(), 2U);
    EXPECT_EQ(std::get<WhittedSurface>(file.materials.at(file.parts[0].material.value()).surface).diffuse,
              (Rgb{1, 0, 0}));
    EXPECT_EQ(std::get<WhittedSurface>(file.materials.at(file.parts[1].material.value()).surface).diffuse,
              (Rgb{0, 1, 0}));
    ASSERT_EQ(file.warnings.size(), 1U) << "the second \"a\"";
    EXPECT_TRUE(file.warnings[0].pointer.ends_with("c.mtl:3")) << file.warnings[0].pointer;
  }
}

TEST_F(ObjMaterials, MissingOnesAreWarnings) {
  write("a.mtl", "newmtl a\n");
  const Imported file =
      read_with("mtllib a.mtl\nmtllib b.mtl\nmtllib b.mtl\nusemtl b\nusemtl c\nf 1 2 3\nusemtl a\nf 1 2 3\n");
  ASSERT_EQ(file.parts.size(), 2U);
  EXPECT_EQ(file.parts[0].material, std::nullopt);
  EXPECT_EQ(file.parts[1].material, 0U);
  ASSERT_EQ(file.warnings.size(), 2U);
  EXPECT_EQ(file.warnings[0].pointer, "a.obj:6");
  EXPECT_EQ(file.warnings[1].pointer, "a.obj:8");
  EXPECT_EQ(file.warnings[1].detail, "No material library has the material \"b\", nor 1 others");
  EXPECT_EQ(asked_, (std::vector<std::string>{"a.mtl", "b.mtl"})) << "asked for once each";
}

TEST_F(ObjMaterials, EmptyAndBrokenLibraries) {
  write("empty.mtl", "");
  write("binary.mtl", std::string("newmtl a\0", 9));
  const Imported file = read_with("mtllib empty.mtl\nmtllib binary.mtl\nmtllib \nmtllib\nf 1 2 3\n");
  EXPECT_EQ(file.parts.size(), 1U);
  ASSERT_EQ(file.warnings.size(), 2U);
  EXPECT_EQ(file.warnings[1].pointer, "binary.mtl:1");
}

TEST_F(ObjMaterials, LibrariesWithoutNumberAreNotLookedForForever) {
  std::string statements;
  for (int i = 0; i < 5000; ++i) statements += "mtllib " + std::to_string(i) + " a b c\n";
  EXPECT_EQ(read_with(statements + "f 1 2 3\n").parts.size(), 1U);
  EXPECT_LE(asked_.size(), LibrarySearch::kMostNames);
}

TEST_F(ObjMaterials, ComeFromMoreLibrariesThanALineShouldName) {
  std::string statement = "mtllib";
  std::string faces;
  for (int i = 0; i < 100; ++i) {
    const std::string name = 'm' + std::to_string(i);
    write(name + ".mtl", "newmtl " + name + "\n");
    statement += ' ' + name + ".mtl";
    faces += "usemtl " + name + "\nf 1 2 3\n";
  }
  const Imported file = read_with(statement + '\n' + faces);
  EXPECT_EQ(file.materials.size(), 100U);
  EXPECT_TRUE(file.warnings.empty());
}

TEST_F(ObjMaterials, LibrariesAreReadUpToASize) {
  std::string statements;
  for (int i = 0; i < 4; ++i) {
    const std::string name = 'm' + std::to_string(i);
    write(name + ".mtl", "newmtl " + name + "\n#" + std::string(MtlLibraries::kMostBytes / 3, 'x') + '\n');
    statements += "mtllib " + name + ".mtl\n";
  }
  const Imported file = read_with(statements + "f 1 2 3\n");
  EXPECT_EQ(file.materials.size(), 2U);
  EXPECT_EQ(file.warnings.back().pointer, "m3.mtl");
}

/// Whoever sends an OBJ file with its libraries finds them by the scanner, in pieces; the reader has lines of its own.
TEST_F(ObjMaterials, ReaderAndScannerSeeTheSameStatements) {
  constexpr std::string_view kPieces[] = {"mtllib", "MtlLib", " ",  "\t", "\\", "\n", "\r",   "\r\n",
                                          "#",      "a.mtl",  "\"", "v",  "x",  "mt", "\\\n", "\nmtllib b "};
  for (unsigned seed = 0; seed < 3000; ++seed) {
    std::mt19937 random(seed);
    std::string text;
    for (int i = 0; i < 24; ++i) text += kPieces[random() % std::size(kPieces)];

    std::vector<std::string> read, scanned;
    const auto list = [](std::vector<std::string>& names) {
      return [&names](std::string_view name) { return names.emplace_back(name), false; };
    };
    const auto read_by = list(read);
    try {
      import_obj(text, "a.obj", [&](std::string_view name) { return read_by(name), std::nullopt; });
    } catch (const BrokenFile&) {
      continue;  // What it saw until then isn't all.
    }
    LibrarySearch search(list(scanned));
    StatementScanner scanner(kLibraryKeywords,
                             [&](std::string_view, std::string_view arguments) { search.look_for(arguments); });
    for (std::size_t at = 0, size = 0; at < text.size(); at += size) {
      size = 1 + random() % 7;
      scanner.feed(std::string_view(text).substr(at, size));
    }
    scanner.finish();
    EXPECT_EQ(scanned, read) << "seed " << seed << '\n' << text;
  }
}

}  // namespace
}  // namespace tessera::proto
