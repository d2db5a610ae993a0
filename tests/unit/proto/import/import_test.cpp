#include "proto/import/import.h"

#include <filesystem>
#include <fstream>
#include <optional>
#include <stop_token>

#include <gtest/gtest.h>

namespace tessera::proto {
namespace {

namespace fs = std::filesystem;

TEST(FormatOf, GoesByTheEndingInAnyCase) {
  EXPECT_EQ(format_of("a.obj"), FileFormat::obj);
  EXPECT_EQ(format_of("folder.ply/b.PLY"), FileFormat::ply);
  EXPECT_EQ(format_of(".nff"), FileFormat::nff);
  EXPECT_EQ(format_of("part.STL"), FileFormat::stl);
  EXPECT_EQ(format_of("obj"), std::nullopt);
  EXPECT_EQ(format_of("a.obj.gz"), std::nullopt);
  EXPECT_EQ(format_of(""), std::nullopt);
}

class ImportFile : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo& test = *testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("tessera_import_") + test.name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Result<Imported> import(const std::string& text, FileFormat format) {
    std::ofstream(folder_ / "file", std::ios::binary) << text;
    return import_file(folder_ / "file", format, "shown", nullptr);
  }

  fs::path folder_;
};

TEST_F(ImportFile, ReadsEachFormat) {
  EXPECT_EQ(import("s 0 0 0 1\n", FileFormat::nff)->parts.size(), 1U);
  EXPECT_EQ(import("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n", FileFormat::obj)->parts.size(), 1U);
  EXPECT_EQ(import("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                   "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 1 1 0 3 0 1 2\n",
                   FileFormat::ply)
                ->parts.size(),
            1U);
}

TEST_F(ImportFile, SmoothsMeshesWithoutNormalsWhereItIsAsked) {
  // Two triangles, bent by 45 degrees.
  const std::string obj = "v 0 0 0\nv 0 1 0\nv 1 0 0\nv -1 0 1\n", faces = "f 1 3 2\nf 1 2 4\n";
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
      "property list uchar int vertex_indices\nend_header\n0 0 0 0 1 0 1 0 0 -1 0 1\n3 0 2 1 3 0 1 3\n";
  const std::string stl =
      "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nfacet\nouter loop\n"
      "vertex 0 0 0\nvertex 0 1 0\nvertex -1 0 1\nendloop\nendfacet\nendsolid\n";
  const auto normals = [&](const std::string& text, FileFormat format, ImportOptions options) {
    std::ofstream(folder_ / "file", std::ios::binary) << text;
    const auto file = import_file(folder_ / "file", format, "shown", nullptr, {}, options);
    std::size_t count = 0;
    for (const ImportedPart& part : file->parts) count += std::get<TriangleMesh>(part.shape).normals.size();
    return count;
  };
  for (const auto& [text, format] :
       {std::pair(obj + faces, FileFormat::obj), std::pair(ply, FileFormat::ply), std::pair(stl, FileFormat::stl)}) {
    EXPECT_EQ(normals(text, format, {}), 0U);
    EXPECT_EQ(normals(text, format, {.smooth = 50}), 4U);
    EXPECT_EQ(normals(text, format, {.smooth = 40}), 6U) << "the edge is sharp";
  }
  EXPECT_EQ(normals(obj + "s 1\n" + faces, FileFormat::obj, {.smooth = 0}), 4U) << "the file says how smooth it is";
}

TEST_F(ImportFile, GivesABrokenFileAsAProblemWithItsPlace) {
  for (const FileFormat format : {FileFormat::nff, FileFormat::obj, FileFormat::ply}) {
    const Result<Imported> result = import(format == FileFormat::ply ? "ply\nf what\n" : "f what\n", format);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.problem().code, ProblemCode::invalid_document);
    ASSERT_EQ(result.problem().errors.size(), 1U);
    EXPECT_TRUE(result.problem().errors[0].pointer.starts_with("shown:"));
  }
}

TEST_F(ImportFile, SaysWhatAFileIsThatIsNoneOfItsFormat) {
  const std::pair<std::string, std::string> cases[] = {
      {R"({"asset": {"version": "2.0"}, "meshes": []})", "This is a glTF file, not "},
      {"\x89PNG\r\n\x1A\n" + std::string(16, '\0'), "This is a PNG image, not "},
      {"solid cube\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "This is an STL file, not "}};
  for (const auto& [content, words] : cases)
    for (const FileFormat format : {FileFormat::nff, FileFormat::obj, FileFormat::ply}) {
      const Result<Imported> result = import(content, format);
      ASSERT_FALSE(result) << content;
      ASSERT_EQ(result.problem().errors.size(), 1U) << content;
      EXPECT_TRUE(result.problem().errors[0].detail.starts_with(words)) << result.problem().errors[0].detail;
    }
}

TEST_F(ImportFile, SaysNothingThatJsonCannotHold) {
  const std::string bad = "\xFF\x01\xED\xA0\x80\xC3\xA9\xC3";  // U+00E9 is the one good character.
  const Result<Imported> refused = import("ply\nformat ascii 1.0\n" + bad + " 1\n", FileFormat::ply);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.problem().errors.at(0).detail.substr(0, 11), "\"?????\xC3\xA9?\" ");
  EXPECT_TRUE(refused.problem().errors.at(0).detail.ends_with('.'));

  const Result<Imported> warned =
      import("mtllib " + bad + "\nusemtl " + bad + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", FileFormat::obj);
  ASSERT_TRUE(warned);
  EXPECT_NE(warned->warnings.at(1).detail.find("\"?????\xC3\xA9?\""), std::string::npos);
  for (const SceneWarning& warning : warned->warnings) EXPECT_TRUE(warning.detail.ends_with('.'));
}

/// A request that comes in the middle: when the file asks for its material library.
TEST_F(ImportFile, StopsInTheMiddle) {
  std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nmtllib a.mtl\n";
  for (int i = 0; i < 10'000; ++i) text += "f 1 2 3\n";
  std::ofstream(folder_ / "file") << text;
  std::stop_source stop;
  const auto companions = [&](std::string_view) -> std::optional<fs::path> {
    stop.request_stop();
    return std::nullopt;
  };
  EXPECT_THROW(import_file(folder_ / "file", FileFormat::obj, "shown", companions, stop.get_token()), Abandoned);
  EXPECT_TRUE(import_file(folder_ / "file", FileFormat::obj, "shown", companions));
  for (const FileFormat format : {FileFormat::nff, FileFormat::obj, FileFormat::ply}) {
    EXPECT_THROW(import_file(folder_ / "file", format, "shown", nullptr, stop.get_token()), Abandoned);
  }
}

TEST_F(ImportFile, RefusesWhatIsNoReadableFile) {
  for (const fs::path& path : {folder_ / "missing", folder_}) {
    const Result<Imported> result = import_file(path, FileFormat::obj, "shown", nullptr);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.problem().code, ProblemCode::invalid_document);
    EXPECT_EQ(result.problem().errors.at(0).pointer, "shown");
  }
}

TEST_F(ImportFile, RefusesAFileBeyondTheLargestBeforeReadingIt) {
  const fs::path sparse = folder_ / "sparse";
  std::ofstream(sparse).put('v');
  std::error_code error;
  fs::resize_file(sparse, (4ULL << 30) + 1, error);
  if (error) GTEST_SKIP() << "no sparse files of 4 GiB here: " << error.message();
  EXPECT_FALSE(import_file(sparse, FileFormat::obj, "shown", nullptr));
}

}  // namespace
}  // namespace tessera::proto
