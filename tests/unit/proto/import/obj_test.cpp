#include "proto/import/obj.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>

#include <gtest/gtest.h>

#include "proto/import/broken_file.h"
#include "proto/import/mtl.h"
#include "proto/import/polygon.h"

namespace tessera::proto {
namespace {

namespace fs = std::filesystem;
using Triangles = std::vector<TriangleIndices>;

Imported read(std::string_view text) { return import_obj(std::string(text), "a.obj", nullptr); }

std::vector<std::string> errors_of(std::string_view text) {
  std::vector<std::string> errors;
  try {
    read(text);
  } catch (const BrokenFile& broken) {
    for (const FieldError& error : broken.errors) errors.push_back(error.pointer + ": " + error.detail);
  }
  return errors;
}
std::string error_of(std::string_view text) {
  const std::vector<std::string> errors = errors_of(text);
  return errors.size() == 1 ? errors[0] : std::to_string(errors.size()) + " errors";
}

const TriangleMesh& mesh(const Imported& file, std::size_t part = 0) {
  return std::get<TriangleMesh>(file.parts.at(part).shape);
}

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(Obj, PositionsAndFaces) {
  const Imported file = read("# a square\n" + kSquare + "f 1 2 3\nf -4 -2 -1\n");
  ASSERT_EQ(file.parts.size(), 1U);
  EXPECT_EQ(mesh(file).positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh(file).triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_TRUE(mesh(file).normals.empty());
  EXPECT_EQ(file.parts[0].material, std::nullopt);
  EXPECT_TRUE(file.warnings.empty());
}

TEST(Obj, PolygonsAreTiled) {
  const Imported file = read("v 0 0 0\nv 2 -2 0\nv 0 4 0\nv -2 -2 0\nf 2 3 4 1\nf 1 2 3 4\n");
  double area = 0;
  for (const TriangleIndices& t : mesh(file).triangles) area += std::abs(area_vector(mesh(file).positions, t).z);
  EXPECT_EQ(mesh(file).triangles.size(), 4U);
  EXPECT_DOUBLE_EQ(area, 32);
}

TEST(Obj, NormalsWhereEveryCornerHasOne) {
  const std::string normals = "vn 0 0 1\nvn 0 1 1\nvt 0 0\n";
  const Imported with = read(kSquare + normals + "f 1//1 2//1 3//1\nf 1/1/2 3/1/1 4/1/-1\n");
  EXPECT_EQ(mesh(with).positions.size(), 5U) << "the first corner has two normals, so it is two vertices";
  EXPECT_EQ(mesh(with).triangles, (Triangles{{0, 1, 2}, {3, 2, 4}}));
  EXPECT_EQ(mesh(with).normals[0], (Vec3{0, 0, 1}));
  EXPECT_EQ(mesh(with).normals[3], (Vec3{0, 1, 1}));
  EXPECT_EQ(mesh(with).positions[3], Vec3{});

  const Imported without = read(kSquare + normals + "f 1//1 2//1 3//1\nf 1/1 3/1 4/1\n");
  EXPECT_TRUE(mesh(without).normals.empty());
  EXPECT_EQ(mesh(without).positions.size(), 4U);
  ASSERT_EQ(without.warnings.size(), 1U);
  EXPECT_EQ(without.warnings[0].pointer, "a.obj:8");
}

TEST(Obj, ManyNormalsAtOnePositionTakeNoTimeInTheirSquare) {
  std::string text = kSquare;
  for (int i = 1; i <= 50'000; ++i)
    text += "vn 0 " + std::to_string(i) + " 1\nf 1//" + std::to_string(i) + " 2//1 3//1\n";
  EXPECT_EQ(mesh(read(text)).triangles.size(), 50'000U);
}

TEST(Obj, APartForEachObjectGroupAndMaterial) {
  const Imported file = read(kSquare +
                             "f 1 2 3\no one\nf 1 2 3\ng a b\nf 1 2 3\nusemtl red\nf 1 2 3\nusemtl green\nf 1 2 3\n"
                             "usemtl red\nf 2 3 4\ng\nf 1 2 3\no two\nusemtl red\nf 1 2 3\no one\ng a b\nf 1 2 4\n");
  std::vector<std::size_t> sizes;
  for (const ImportedPart& part : file.parts) sizes.push_back(std::get<TriangleMesh>(part.shape).triangles.size());
  EXPECT_EQ(sizes, (std::vector<std::size_t>{1, 1, 1, 3, 1, 1, 1}));
}

TEST(Obj, FacesMayNameWhatComesLater) {
  EXPECT_EQ(mesh(read("f 1//1 2//1 3//1\n" + kSquare + "vn 0 0 1\n")).normals.size(), 3U);
}

TEST(Obj, LinesMayEndAsOnAnySystemBeContinuedAndHaveComments) {
  const std::string text = kSquare + "f 1 2 3 4 # both\nv 5 5 5#\nv 6 6 6 #\n";
  EXPECT_EQ(errors_of(text).size(), 1U) << "5# is no number";
  const std::string good = kSquare + "f 1 2 3 4\t# both\n";
  std::string windows, mac = good;
  for (const char c : good) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  std::replace(mac.begin(), mac.end(), '\n', '\r');
  for (const std::string& form : {good, windows, mac, "\xEF\xBB\xBF" + good, good.substr(0, good.size() - 1)}) {
    EXPECT_EQ(mesh(read(form)).triangles.size(), 2U);
    EXPECT_TRUE(read(form).warnings.empty());
  }
  const std::string split = kSquare + "# no \\\nf 1 \\\n 2 \\ \t\n3 \\\r\n4\nf 1 2\n";
  EXPECT_EQ(mesh(read(split)).triangles.size(), 2U);
  ASSERT_EQ(read(split).warnings.size(), 1U);
  EXPECT_EQ(read(split).warnings[0].pointer, "a.obj:10") << "continued lines count";
}

TEST(Obj, NumbersInEveryForm) {
  const Imported file = read("v 1. +.5 -1e+1\nv  1E0\t2 3\n  v 1e-60 0 0 \nf 1 2 3\n");
  EXPECT_EQ(mesh(file).positions, (std::vector<Vec3>{{1, 0.5F, -10}, {1, 2, 3}, {0, 0, 0}}));
}

TEST(Obj, ANumberThatIsNoneIsRefusedWithItsLine) {
  EXPECT_EQ(errors_of("v 0x1 0 0\nv 1 3.1+e2 0\n\nv 1 2\nvn 1 2 z\nv\nf\nv 1 1 1\n"),
            (std::vector<std::string>{
                "a.obj:1: A number is expected here, not \"0x1\"", "a.obj:2: A number is expected here, not \"3.1+e2\"",
                "a.obj:4: Three numbers are expected here", "a.obj:5: A number is expected here, not \"z\"",
                "a.obj:6: This line has no numbers", "a.obj:7: This line has no numbers"}));
}

TEST(Obj, TrianglesThatArentFiniteAreDroppedAndCounted) {
  const Imported file = read(kSquare +
                             "v nan 0 0\nv inf 0 0\nv 1e999 0 0\nv 1.#IND 0 0\n"
                             "f 1 2 5\nf 1 2 6\nf 1 2 7\nf 1 2 8\nf 1 2 3\nf 1 2 2\nf 1 2\n");
  EXPECT_EQ(mesh(file).triangles.size(), 1U);
  ASSERT_EQ(file.warnings.size(), 3U);
  EXPECT_NE(file.warnings[1].detail.find("(4 times)"), std::string::npos);
}

TEST(Obj, CornersThatAreNone) {
  for (const char* face :
       {"1 2 x", "1 2 3a", "1 2 0", "1/0 2 3", "1//0 2//1 3//1", "1 2 3/", "1 2 3//", "1/1/ 2 3", "1/1/1/1 2 3",
        "/1 2 3", "1-2 2 3", "1 2 +", "1 2 4294967297", "1.5 2 3", "1 2 3 \"", "//1 2 3"}) {
    const std::vector<std::string> errors = errors_of(kSquare + "vt 0 0\nvn 0 0 1\nf " + face + '\n');
    ASSERT_EQ(errors.size(), 1U) << face;
    EXPECT_TRUE(errors[0].starts_with("a.obj:7: A face's corners are written")) << errors[0];
  }
  EXPECT_TRUE(errors_of(kSquare + "vt 0 0\nvn 0 0 1\nf +1/1/1 -3//+1\t3 \n").empty());
}

TEST(Obj, IndicesOutOfRangeAreAllNamed) {
  EXPECT_EQ(
      errors_of(kSquare + "f 1 2 5\nf 1 2 3\nf -5 1 2\nvt 0 0\nf 1/2 2/1 3/1\nf 1/-2 2/1 3/1\nf 1//1 2//1 3//1\n"),
      (std::vector<std::string>{
          "a.obj:7: Vertex -5 is out of range: before this line there are 4",
          "a.obj:10: Texture coordinate -2 is out of range: before this line there are 1",
          "a.obj:5: Vertex 5 is out of range: the file has 4",
          "a.obj:9: Texture coordinate 2 is out of range: the file has 1",
          "a.obj:11: Normal 1 is out of range: the file has 0",
      }));
  std::string many;
  for (int i = 0; i < 100; ++i) many += "f 1 2 3\n";
  EXPECT_EQ(errors_of(many).size(), kMaxFieldErrors);
  EXPECT_EQ(error_of(kSquare + "f 1 2 999999999\n"), "a.obj:5: Vertex 999999999 is out of range: the file has 4");
}

TEST(Obj, WhatIsNoText) {
  EXPECT_EQ(error_of(std::string_view("\xFE\xFF\0v", 4)), "a.obj:1: The file is UTF-16: save it as UTF-8");
  EXPECT_EQ(error_of(std::string_view("v 0 0 0\nv 1 0\0 0\n", 17)), "a.obj:2: A byte 0: this is no text");
}

TEST(Obj, IgnoredStatementsAreCounted) {
  const Imported file = read(kSquare + "l 1 2\ns off\np 1\nf 1 2 3\nend\n");
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_EQ(file.warnings[0].pointer, "a.obj:5");
  EXPECT_NE(file.warnings[0].detail.find("(3 times)"), std::string::npos);
  EXPECT_EQ(read("v 0 0 0 1 0.5 0.5\nv 1 0 0\nv 0 1 0\nf 1 2 3").warnings.size(), 1U) << "a vertex colour";
}

TEST(Obj, WithoutFacesThereIsNoPartButAWarning) {
  for (const std::string& text : {std::string(), kSquare, kSquare + "f 1 1 1\n"}) {
    const Imported file = read(text);
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

  Material material(const std::string& mtl) {
    write("m.mtl", "newmtl m\n" + mtl);
    const Imported file = read_with("mtllib m.mtl\nusemtl m\nf 1 2 3\n");
    return file.materials.at(file.parts.at(0).material.value());
  }

  fs::path folder_;
  std::vector<std::string> asked_;
};

TEST_F(ObjMaterials, MapOntoWhitted) {
  const Material plain = material("Kd 0.1 0.2 0.3\nKs 0.4 0.5 0.6\nNs 20\nNi 1.5\nillum 2\n");
  EXPECT_EQ(plain.diffuse, (Rgb{0.1F, 0.2F, 0.3F}));
  EXPECT_EQ(plain.specular, (Rgb{0.4F, 0.5F, 0.6F}));
  EXPECT_EQ(plain.shininess, 20);
  EXPECT_TRUE(plain.reflect.is_black());
  EXPECT_TRUE(plain.transmit.is_black());
  EXPECT_EQ(plain.ior, 1);
  EXPECT_FALSE(plain.fresnel);

  EXPECT_TRUE(material("Ks 1 1 1\nillum 1\n").specular.is_black());
  EXPECT_EQ(material("Ks 1 0.5 0\nillum 3\n").reflect, (Rgb{1, 0.5F, 0}));

  const Material glass = material("Kd 1 1 1\nKs 0.25 0.25 0.25\nd 0.25\nNi 1.5\nillum 7\n");
  EXPECT_EQ(glass.diffuse, (Rgb{0.25F, 0.25F, 0.25F}));
  EXPECT_EQ(glass.transmit, (Rgb{0.75F, 0.75F, 0.75F}));
  EXPECT_EQ(glass.reflect, (Rgb{0.25F, 0.25F, 0.25F}));
  EXPECT_EQ(glass.ior, 1.5F);
  EXPECT_TRUE(glass.fresnel);

  EXPECT_EQ(material("Tr 0.25\n").transmit, (Rgb{0.25F, 0.25F, 0.25F}));
  EXPECT_FALSE(material("Tr 0.25\nillum 6\nNi 1.3").fresnel);
  EXPECT_EQ(material("Tr 0.25\nillum 6\nNi 1.3").ior, 1.3F);
}

TEST_F(ObjMaterials, NumbersThatAreNoneCountAsZeroAndAreNamed) {
  write("m.mtl", "newmtl m\nKd nan 0.5 0x9\nKs -1 2 1e999\nNs -3\nNi -1\nd 7\nillum 7\n");
  const Imported file = read_with("mtllib m.mtl\nusemtl m\nf 1 2 3\n");
  EXPECT_EQ(file.materials[0].diffuse, (Rgb{0, 0.5F, 0}));
  EXPECT_EQ(file.materials[0].specular, (Rgb{0, 2, 0}));
  EXPECT_EQ(file.materials[0].shininess, 0);
  EXPECT_EQ(file.materials[0].ior, 1);
  EXPECT_TRUE(file.materials[0].transmit.is_black());
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_EQ(file.warnings[0].pointer, "m.mtl:2");
  EXPECT_NE(file.warnings[0].detail.find("(2 times)"), std::string::npos) << file.warnings[0].detail;
}

TEST_F(ObjMaterials, TexturesAreNamedAsIgnored) {
  write("m.mtl", "newmtl m\nKd 0 0 0\nmap_Kd -s 1 1 1 a.png\nbump b.png\n");
  const Imported file = read_with("mtllib m.mtl\nusemtl m\nf 1 2 3\n");
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_EQ(file.warnings[0].pointer, "m.mtl:3");
  EXPECT_FALSE(file.materials[0].diffuse.is_black()) << "black times a texture isn't black";
}

TEST_F(ObjMaterials, ComeFromSeveralLibrariesWhoseNamesMayHoldBlanks) {
  write("a.mtl", "newmtl a\nKd 1 0 0\n");
  write("sub/b c.mtl", "newmtl  b b \nKd 0 1 0\nnewmtl a\nKd 0 0 1\n");
  for (const char* libraries : {"mtllib a.mtl sub/b c.mtl\n", "mtllib a.mtl\nmtllib  sub\\b\\ c.mtl \n"}) {
    const Imported file = read_with(std::string("usemtl a \nf 1 2 3\nusemtl b b\nf 1 2 4\n") + libraries);
    ASSERT_EQ(file.parts.size(), 2U);
    EXPECT_EQ(file.materials.at(file.parts[0].material.value()).diffuse, (Rgb{1, 0, 0}));
    EXPECT_EQ(file.materials.at(file.parts[1].material.value()).diffuse, (Rgb{0, 1, 0}));
    EXPECT_TRUE(file.warnings.empty());
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
    MtllibScanner scanner([&](std::string_view arguments) { search.look_for(arguments); });
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
