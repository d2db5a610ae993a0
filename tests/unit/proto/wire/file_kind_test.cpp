#include "proto/wire/file_kind.h"

#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace tessera::proto {
namespace {

using namespace std::string_literals;

FileKind kind_of(const std::string& bytes) { return file_kind(bytes, bytes.size()); }

std::string binary_stl(char triangles) {
  return std::string(80, 's') + triangles + "\0\0\0"s + std::string(50 * triangles, 'x');
}

TEST(FileKind, KnowsOurs) {
  EXPECT_EQ(kind_of(R"( {"objects": []})"), FileKind::json);
  EXPECT_EQ(kind_of("\xEF\xBB\xBF{\"objects\": []}"), FileKind::json);
  EXPECT_EQ(kind_of("[1, 2"), FileKind::json) << "broken, but meant so";
  EXPECT_EQ(kind_of("ply\nformat ascii 1.0\n"), FileKind::ply);
  EXPECT_EQ(kind_of("ply\r\nformat ascii 1.0\r\n"), FileKind::ply);
  EXPECT_EQ(kind_of("ply"), FileKind::ply);
  EXPECT_EQ(kind_of("newmtl red\nKd 1 0 0\n"), FileKind::mtl);
}

TEST(FileKind, TellsObjFromNff) {
  for (const char* obj : {"v 0 0 0\n", "# Blender\n\n  v 0 0 0\n", "mtllib a.mtl\nv 0 0 0\n", "MTLLIB a.mtl\n",
                          "o thing\n", "s off\ng a\n", "f 1/1 2/2 3/3\n", "f 1 2 3\n", "f -3 -2 -1\n",
                          "\xEF\xBB\xBFv 0 0 0\n", "# a\rv 1 2 3\r", "s 1\nv 0 0 0 1\n", "vn 0 0 1", "l 1 2\nv 0 0 0"})
    EXPECT_EQ(kind_of(obj), FileKind::obj) << obj;
  for (const char* nff :
       {"v\nfrom 0 0 5\nat 0 0 0\n", "# balls\r\nv\r\nfrom 0 0 5\r\n", "b 0.1 0.2 0.3\nv\n", "l 4 3 2\nv\nfrom 1 1 1\n",
        "f 1 0.5 0.2 0.8 0.2 10 0 1\ns 0 0 0 1\n", "s 0 0 0 1\nf 1 0.5 0.2 0.8 0.2 10 0 1\n", "v"})
    EXPECT_EQ(kind_of(nff), FileKind::nff) << nff;
}

TEST(FileKind, KnowsGltfHoweverItsMembersAreSorted) {
  EXPECT_EQ(kind_of(R"({"asset": {"version": "2.0"}, "scenes": []})"), FileKind::gltf);
  EXPECT_EQ(kind_of(R"({"scene": 0, "asset" : { "generator": "x \" \\", "version" : "2.0" } })"), FileKind::gltf);
  EXPECT_EQ(kind_of(R"({"accessors": [{"bufferView": 0)"), FileKind::gltf) << "cut off";
  EXPECT_EQ(kind_of(R"({"scene": {"asset": {"version": "2.0"}}})"), FileKind::json) << "not at the top";
  EXPECT_EQ(kind_of(R"({"name": "asset", "objects": [{"version": 2}]})"), FileKind::json);
  EXPECT_EQ(kind_of(R"({"asset": {}, "settings": {"version": 2}})"), FileKind::json);
  EXPECT_EQ(kind_of("{" + std::string(100000, '[')), FileKind::json);
  EXPECT_EQ(kind_of("glTF\2\0\0\0"s), FileKind::glb);
}

TEST(FileKind, KnowsStlByItsSize) {
  EXPECT_EQ(kind_of(binary_stl(1)), FileKind::stl_binary);
  EXPECT_EQ(kind_of(binary_stl(3)), FileKind::stl_binary);
  EXPECT_EQ(kind_of(binary_stl(3) + 'x'), FileKind::unknown);
  EXPECT_EQ(kind_of("solid" + binary_stl(2).substr(5)), FileKind::stl_binary) << "many begin like ascii ones";
  EXPECT_EQ(kind_of("solid cube\n facet normal 0 0 1\n"), FileKind::stl_ascii);
  EXPECT_EQ(kind_of("solid empty\nendsolid empty\n"), FileKind::stl_ascii);
  const std::string head = binary_stl(100).substr(0, 84);
  EXPECT_EQ(file_kind(head + std::string(kFileHead, 'x'), 84 + 100 * 50), FileKind::stl_binary)
      << "from its head alone";
}

TEST(FileKind, KnowsOthersByTheirSignatures) {
  const std::pair<std::string, FileKind> files[] = {
      {"\x89PNG\r\n\x1A\n"s, FileKind::png},
      {"\xFF\xD8\xFF\xE0"s, FileKind::jpeg},
      {"GIF89a", FileKind::gif},
      {"II*\0"s, FileKind::tiff},
      {"RIFF....WEBP", FileKind::webp},
      {"#?RADIANCE\n", FileKind::hdr},
      {"\x76\x2F\x31\x01"s, FileKind::exr},
      {"%PDF-1.7\n", FileKind::pdf},
      {"PK\x03\x04"s, FileKind::zip},
      {"\x1F\x8B\x08"s, FileKind::gzip},
      {"Kaydara FBX Binary  \0"s, FileKind::fbx},
      {"; FBX 7.4.0 project file\n", FileKind::fbx},
      {"BLENDER-v300", FileKind::blend},
      {"PXR-USDC", FileKind::usd},
      {"#usda 1.0\n", FileKind::usd},
      {"#VRML V2.0 utf8\n", FileKind::vrml},
      {"<?xml version=\"1.0\"?>\n<COLLADA xmlns=\"\">", FileKind::collada},
      {"<!DOCTYPE html><html>", FileKind::html},
      {"<?xml version=\"1.0\"?><scene/>", FileKind::xml},
      {"OFF\n8 6 12\n", FileKind::off},
      {"MM\x0C\0\0\0......"s, FileKind::three_ds},
      {"\x7F"
       "ELF",
       FileKind::program},
      {std::string(257, '\0') + "ustar\0"s, FileKind::tar},
  };
  for (const auto& [bytes, kind] : files) EXPECT_EQ(kind_of(bytes), kind) << description(kind);
}

TEST(FileKind, IsUnknownWhereNothingTells) {
  for (const std::string& bytes : {""s, "\n\n"s, "# only a comment\n"s, "hello world\n"s, "v x y z\n"s, "s 1\n"s,
                                   "from here\n"s, "\xFE\xFF\0v"s, "x\0v 0 0 0\n"s, "plywood 1 2\n"s, "f\n"s})
    EXPECT_EQ(kind_of(bytes), FileKind::unknown) << bytes;
  EXPECT_EQ(file_kind(std::filesystem::path("/no/such/file")), FileKind::unknown);
  EXPECT_EQ(file_kind("# " + std::string(kFileHead, 'c') + "\nv", kFileHead + 1000), FileKind::unknown)
      << "a last line that is cut off says nothing";
}

TEST(FileKind, IsDescribed) {
  for (int i = 0; i <= static_cast<int>(FileKind::program); ++i)
    EXPECT_TRUE(description(static_cast<FileKind>(i)).starts_with('a')) << i;
  EXPECT_EQ(description(FileKind::gltf), "a glTF file");
  EXPECT_EQ(description(FileKind::program), "a program");
}

}  // namespace
}  // namespace tessera::proto
