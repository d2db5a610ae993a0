#include <set>

#include <gtest/gtest.h>

#include "proto/parse.h"
#include "tests/unit/proto/test_files.h"

namespace tessera::proto {
namespace {

ContentHash hash_of(const std::string& text, const FileSource& files = NoFiles()) {
  const auto result = parse_scene(text, files, Limits());
  if (!result) {
    ADD_FAILURE() << text << result.problem().errors.at(0).pointer << result.problem().errors.at(0).detail;
    return "";
  }
  EXPECT_TRUE(is_content_hash(result->hash));
  return result->hash;
}

TEST(SceneHash, KeyOrderSpaceAndSpellingDoNotMatter) {
  const ContentHash hash = hash_of(R"({"background": [0.5, 0, 1], "materials": {"a": {"type": "diffuse",
    "color": [1, 0, 0]}, "b": {"type": "whitted"}}, "objects": [{"type": "sphere", "center": [0, 0, 20], "radius": 1,
    "material": "a"}]})");
  for (const char* same : {
           R"({"objects":[{"material":"a","radius":1,"center":[0,0,20],"type":"sphere"}],"materials":{"b":{"type":
              "whitted"},"a":{"color":[1,0,0],"type":"diffuse"}},"background":[0.5,0,1]})",
           R"({"background": [5e-1, 0.0, 1.0], "materials": {"\u0061": {"type": "diffuse",
              "color": [1, 0, 0]}, "b": {"type": "whitted"}}, "objects": [{"type": "sphere", "center": [0, 0, 2e1],
              "radius": 1, "material": "a"}]})",
       }) {
    EXPECT_EQ(hash_of(same), hash) << same;
  }
}

TEST(SceneHash, TheNameOfTheSchemaDoesNotMatter) {
  EXPECT_EQ(hash_of(R"({"$schema": "a", "objects": []})"), hash_of(R"({"objects": []})"));
  const std::string material = R"({"objects": [], "materials": {"$schema": {"type": "whitted"}}})";
  EXPECT_NE(hash_of(material), hash_of(R"({"objects": [], "materials": {}})"));
  const auto wrong = parse_scene(R"({"$schema": 1, "objects": []})", NoFiles(), Limits());
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.problem().errors.at(0).pointer, "/$schema");
}

TEST(SceneHash, EveryDifferenceMatters) {
  std::set<ContentHash> hashes;
  const std::vector<std::string> scenes{
      R"({"objects": []})",
      R"({"objects": [], "lights": []})",
      R"({"objects": [], "background": [0, 0, 0]})",
      R"({"objects": [], "background": [0, 0, 1]})",
      R"({"objects": [], "background": [0, 1, 0]})",
      R"({"objects": [], "background": [0, 1.0000001, 0]})",
      R"({"objects": [], "materials": {"a": {"type": "whitted"}}})",
      R"({"objects": [], "materials": {"b": {"type": "whitted"}}})",
      R"({"objects": [], "materials": {"b": {"type": "whitted", "fresnel": true}}})",
      R"({"objects": [], "materials": {"b": {"type": "whitted", "fresnel": false}}})",
      R"({"objects": [], "materials": {"b:": {"type": "whitted"}}})",
      R"({"objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}]})",
      R"({"objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1},
                      {"type": "sphere", "center": [0, 0, 0], "radius": 2}]})",
      R"({"objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 2},
                      {"type": "sphere", "center": [0, 0, 0], "radius": 1}]})",
  };
  for (const std::string& text : scenes) EXPECT_TRUE(hashes.insert(hash_of(text)).second) << text;
}

constexpr std::string_view kTriangle =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
constexpr std::string_view kModel = "mtllib colours.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";

std::string object(const std::string& fields) { return R"({"objects": [{"type": "file", )" + fields + "}]}"; }

TEST(SceneHash, FilesCountByContentAndFormatAlone) {
  TestFiles files;
  files.add_asset("a.ply", kTriangle);
  files.add_asset("sub/b.PLY", kTriangle);
  files.add_asset("c.ply", std::string(kTriangle) + "\n");
  const std::string blob = files.add_blob(kTriangle);
  const ContentHash hash = hash_of(object(R"("path": "a.ply")"), files);
  EXPECT_EQ(hash_of(object(R"("path": "a.ply", "format": "ply")"), files), hash);
  EXPECT_EQ(hash_of(object(R"("path": "sub/b.PLY")"), files), hash);
  EXPECT_EQ(hash_of(object(R"("format": "ply", "blob": ")" + blob + "\""), files), hash);
  EXPECT_NE(hash_of(object(R"("path": "c.ply")"), files), hash) << "another content";
  EXPECT_NE(hash_of(object(R"("path": "a.ply", "transform": {"scale": 2})"), files), hash);
  const auto geometry = [](const std::string& fields) {
    return R"({"objects": [{"type": "instance", "of": "g"}], "geometries": {"g": {"type": "file", )" + fields + "}}}";
  };
  EXPECT_EQ(hash_of(geometry(R"("path": "a.ply")"), files), hash_of(geometry(R"("path": "sub/b.PLY")"), files));
}

TEST(SceneHash, CompanionsCountWhereTheFileAsksForThem) {
  TestFiles files;
  files.add_asset("a/model.obj", kModel);
  files.add_asset("a/colours.mtl", "newmtl red\nKd 1 0 0\n");
  files.add_asset("b/model.obj", kModel);
  files.add_asset("b/colours.mtl", "newmtl red\nKd 0.5 0 0\n");
  files.add_asset("c/model.obj", kModel);
  const std::string model = files.add_blob(kModel), colours = files.add_blob("newmtl red\nKd 1 0 0\n"),
                    note = files.add_blob("hello");
  const ContentHash a = hash_of(object(R"("path": "a/model.obj")"), files);
  EXPECT_NE(hash_of(object(R"("path": "b/model.obj")"), files), a);
  EXPECT_NE(hash_of(object(R"("path": "c/model.obj")"), files), a) << "without its companion";
  const std::string blob = R"("format": "obj", "blob": ")" + model + R"(", "companions": {)";
  const std::string mtl = R"("colours.mtl": ")" + colours + '"';
  EXPECT_EQ(hash_of(object(blob + mtl + "}"), files), a);
  EXPECT_EQ(hash_of(object(blob + mtl + R"(, "note.txt": ")" + note + "\"}"), files), a) << "nobody asks for the note";
  EXPECT_EQ(hash_of(object(blob + "}"), files), hash_of(object(R"("path": "c/model.obj")"), files));
}

TEST(SceneHash, ADocumentWithItsFilesNamedByContentHasTheSame) {
  TestFiles files;
  files.add_asset("a/model.obj", kModel);
  files.add_asset("a/colours.mtl", "newmtl red\nKd 1 0 0\n");
  files.add_asset("b.ply", kTriangle);
  const std::string stays = files.add_blob(kTriangle);
  const auto parsed = parse_scene(R"({"background": [0.1, 1e-3, 0], "objects": [
    {"type": "file", "path": "a/model.obj", "transform": {"scale": 2}},
    {"type": "instance", "of": "b\"\u00e9", "transform": [1, 0, 0, 0.5, 0, 1, 0, -0.0, 0, 0, 1, 0]},
    {"type": "file", "blob": ")" + stays +
                                      R"(", "format": "ply"}],
    "geometries": {"b\"\u00e9": {"path": "b.ply", "type": "file"}}})",
                                  files, Limits());
  ASSERT_TRUE(parsed);
  ASSERT_TRUE(parsed->captured);
  EXPECT_EQ(parsed->captured->files.size(), 3U);
  files.add_asset("a/model.obj", "");  // What it was made of may change.
  files.add_asset("a/colours.mtl", "newmtl blue\n");
  files.add_blob(kModel);
  files.add_blob("newmtl red\nKd 1 0 0\n");
  const auto again = parse_scene(parsed->captured->document, files, Limits());
  ASSERT_TRUE(again) << parsed->captured->document << again.problem().errors.at(0).detail;
  EXPECT_EQ(again->hash, parsed->hash);
  EXPECT_EQ(again->scene->objects.size(), 3U);
  EXPECT_FALSE(again->captured) << "it names no path any more";
}

}  // namespace
}  // namespace tessera::proto
