#include "client/scene_files.h"

#include <nlohmann/json.hpp>

#include "client/failure.h"
#include "tests/support/temporary_folder.h"

namespace tessera::client {
namespace {

using nlohmann::json;
using SceneFiles = FolderTest;

json file_object(const std::string& path) { return {{"type", "file"}, {"path", path}}; }

TEST_F(SceneFiles, FindsFilesAtAnyDepth) {
  const auto a = write("a.ply", "ply a");
  const auto b = write("meshes/b.PLY", "ply b");
  json job{{"scene", {{"objects", {file_object("a.ply")}}, {"geometries", {{"b", file_object("meshes/b.PLY")}}}}}};

  const NamedFiles found = name_files_by_content(job, {.folder = folder_});

  const json& object = job["scene"]["objects"][0];
  EXPECT_EQ(object, json({{"type", "file"}, {"format", "ply"}, {"blob", proto::content_hash("ply a")}}));
  EXPECT_EQ(job["scene"]["geometries"]["b"]["blob"], proto::content_hash("ply b"));
  ASSERT_EQ(found.to_upload.size(), 2U);
  EXPECT_EQ(found.to_upload[0], (LocalFile{b, proto::content_hash("ply b")}));
  EXPECT_EQ(found.to_upload[1], (LocalFile{a, proto::content_hash("ply a")}));
  EXPECT_TRUE(found.left_to_server.empty());
}

TEST_F(SceneFiles, BringsTheMapOfAnEnvironment) {
  const auto map = write("maps/sky.hdr", "#?RADIANCE");
  json light{{"type", "environment"}, {"path", "maps/sky.hdr"}};
  const NamedFiles found = name_files_by_content(light, {.folder = folder_});
  EXPECT_EQ(light, json({{"type", "environment"}, {"blob", proto::content_hash("#?RADIANCE")}}));
  EXPECT_EQ(found.to_upload, (std::vector{LocalFile{map, proto::content_hash("#?RADIANCE")}}));
  json missing{{"type", "environment"}, {"path", "maps/night.hdr"}};
  EXPECT_EQ(name_files_by_content(missing, {.folder = folder_}).left_to_server,
            std::vector<std::string>{"maps/night.hdr"});
  EXPECT_EQ(missing["path"], "maps/night.hdr");
}

TEST_F(SceneFiles, BringsTheMaterialLibrariesOfAnObj) {
  const std::string obj = "# mtllib no.mtl\nmtllib  one.mtl sub/two.mtl\r\n  mtllib missing.mtl\nv 0 0 0\n";
  write("mesh/cube.obj", obj);
  write("mesh/one.mtl", "one");
  write("mesh/sub/two.mtl", "two");
  write("mesh/no.mtl", "no");
  json document = file_object("mesh/cube.obj");

  const NamedFiles found = name_files_by_content(document, {.folder = folder_});

  EXPECT_EQ(document["blob"], proto::content_hash(obj));
  EXPECT_EQ(document["companions"],
            json({{"one.mtl", proto::content_hash("one")}, {"sub/two.mtl", proto::content_hash("two")}}));
  EXPECT_EQ(found.to_upload.size(), 3U);
}

TEST_F(SceneFiles, BringsTheTexturesThatLibrariesName) {
  write("mesh/cube.obj", "mtllib sub/one.mtl\n# mtllib no.mtl\n");
  write("mesh/sub/one.mtl",
        "newmtl a\nmap_Kd -s 2 2 2 Wood.PNG\n# map_Kd no.png\nbump -bm 0.5 ..\\rough \\\n stone.png\nmap_Ka no.png\n"
        "map_Kd missing.png\nmap_Kd ../../../secret.png\nmap_d one.mtl.png");
  write("mesh/no.mtl", "map_Kd no2.png\n");
  for (const char* name : {"mesh/sub/wood.png", "mesh/rough    stone.png", "mesh/sub/no.png", "mesh/no2.png",
                           "mesh/no.png", "mesh/sub/one.mtl.png", "mesh/sub/unnamed.png"})
    write(name, name);
  json document = file_object("mesh/cube.obj");
  const NamedFiles found = name_files_by_content(document, {.folder = folder_});
  document["companions"].erase("sub/one.mtl");
  EXPECT_EQ(document["companions"], json({{"sub/Wood.PNG", proto::content_hash("mesh/sub/wood.png")},
                                          {"rough    stone.png", proto::content_hash("mesh/rough    stone.png")},
                                          {"sub/one.mtl.png", proto::content_hash("mesh/sub/one.mtl.png")}}));
  EXPECT_EQ(found.to_upload.size(), 5U);
  EXPECT_TRUE(found.notes.empty());
}

TEST_F(SceneFiles, BringsTheTextureThatAPlyNames) {
  write("skin.png", "skin");
  write("other.png", "other");
  write("a.ply", "ply\r\ncomment TextureFile  .\\skin.png\r\ncomment TextureFile other.png\r\nend_header\r\n");
  json document = file_object("a.ply");
  name_files_by_content(document, {.folder = folder_});
  EXPECT_EQ(document["companions"], json({{"skin.png", proto::content_hash("skin")}}));
  write("b.ply", "ply\nend_header\ncomment TextureFile skin.png\n");
  document = file_object("b.ply");
  name_files_by_content(document, {.folder = folder_});
  EXPECT_FALSE(document.contains("companions"));
}

TEST_F(SceneFiles, BringsTheBuffersAndImagesOfAGltf) {
  const std::string gltf =
      R"({"images": [{"uri": "in/a%20b.png"}, {"bufferView": 0}, {"uri": 3}, 4, {"uri": "gone.png"}],
    "extras": {"buffers": [{"uri": "unnamed.bin"}]},
    "buffers": [{"uri": "DATA.bin"}, {"uri": "data:,x"}, {"uri": "http://x/secret.bin"}, {"uri": "../secret.bin"},
                {"uri": "link.bin"}, {"uri": "in/a%20b.png"}]})";
  for (const char* name : {"mesh/in/a b.png", "mesh/data.bin", "mesh/unnamed.bin", "secret.bin"}) write(name, name);
  std::filesystem::create_symlink(folder_ / "secret.bin", folder_ / "mesh/link.bin");
  const json expected{{"in/a b.png", proto::content_hash("mesh/in/a b.png")},
                      {"DATA.bin", proto::content_hash("mesh/data.bin")}};
  const auto size = static_cast<unsigned char>(gltf.size() & 255), more = static_cast<unsigned char>(gltf.size() >> 8);
  std::string glb = "glTF" + std::string(8, '\1');
  glb += {static_cast<char>(size), static_cast<char>(more), '\0', '\0'};
  glb += "JSON" + gltf + std::string(100, '\7');
  write("mesh/a.gltf", gltf);
  write("mesh/a.glb", glb);
  write("mesh/b.gltf", R"({"later": [)" + std::string(100'000, ' ') + "]," + gltf.substr(1));
  for (const char* name : {"a.gltf", "a.glb", "b.gltf"}) {
    json document = file_object(name);
    const NamedFiles found = name_files_by_content(document, {.folder = folder_ / "mesh"});
    EXPECT_EQ(document["format"], "gltf");
    EXPECT_EQ(document["companions"], expected) << name;
    EXPECT_EQ(found.to_upload.size(), 3U);
    ASSERT_EQ(found.notes.size(), 1U);
    EXPECT_NE(found.notes[0].find("link.bin lies outside"), std::string::npos);
  }
  json document = file_object("a.gltf");
  name_files_by_content(document, {.folder = folder_ / "mesh", .allow_outside = true});
  EXPECT_EQ(document["companions"].size(), 3U);
  write("mesh/broken.gltf", R"({"asset": {"version": "2.0"}, "buffers": [{"uri": "unnamed.bin")");
  write("mesh/short.glb", "glTF");
  for (const char* name : {"broken.gltf", "short.glb"}) {
    document = file_object(name);
    name_files_by_content(document, {.folder = folder_ / "mesh"});
    EXPECT_FALSE(document.contains("companions")) << name;
  }
}

TEST_F(SceneFiles, LeavesTexturesOutsideTheFolder) {
  const auto secret = write("secret.png", "secret");
  write("in/a.obj", "mtllib a.mtl\n");
  write("in/a.mtl", "newmtl a\nmap_Kd ../secret.png\nmap_Ke " + secret.string() + "\nmap_d link.png\n");
  std::filesystem::create_symlink(secret, folder_ / "in/link.png");
  json document = file_object("a.obj");
  NamedFiles found = name_files_by_content(document, {.folder = folder_ / "in"});
  EXPECT_EQ(document["companions"].size(), 1U);
  ASSERT_EQ(found.notes.size(), 3U);
  EXPECT_EQ(found.notes[0], "the texture " + (folder_ / "in/../secret.png").string() +
                                " lies outside the document's folder and isn't uploaded; --allow-outside lets it");
  document = file_object("a.obj");
  found = name_files_by_content(document, {.folder = folder_ / "in", .allow_outside = true});
  EXPECT_EQ(document["companions"].size(), 4U);
}

TEST_F(SceneFiles, FindsMaterialLibrariesWhereverTheyStandInALargeObj) {
  write("one.mtl", "one");
  write("two.mtl", "two");
  for (const std::size_t before : {1U << 20, (1U << 20) - 9, (1U << 20) - 1, (2U << 20) + 1}) {
    write("a.obj", std::string(before - 1, '#') + "\nmtllib one.mtl\n#\nmtllib two.mtl");
    json document = file_object("a.obj");
    name_files_by_content(document, {.folder = folder_});
    EXPECT_EQ(document["companions"].size(), 2U) << before;
  }
}

TEST_F(SceneFiles, UploadsAFileOnceHoweverOftenItIsNamed) {
  write("a.ply", "ply a");
  json document = json::array({file_object("a.ply"), file_object("a.ply")});
  EXPECT_EQ(name_files_by_content(document, {.folder = folder_}).to_upload.size(), 1U);
  EXPECT_EQ(document[0], document[1]);
}

TEST_F(SceneFiles, LeavesWhatIsNotHere) {
  const json before = json::array({file_object("not-here.obj"),
                                   {{"type", "sphere"}, {"path", "a.ply"}},
                                   {{"type", "file"}, {"path", 3}},
                                   {{"type", {"file"}}, {"path", "a.ply"}},
                                   {{"type", "file"}, {"blob", "sha256:0"}, {"format", "ply"}}});
  write("a.ply", "ply a");
  json document = before;
  const NamedFiles found = name_files_by_content(document, {.folder = folder_});
  EXPECT_EQ(document, before);
  EXPECT_EQ(found.left_to_server, std::vector<std::string>{"not-here.obj"});
  EXPECT_TRUE(found.to_upload.empty());
}

/// What is refused: the errors' pointers and details.
std::vector<std::string> refusal(json document, const SceneFolder& folder) {
  try {
    name_files_by_content(document, folder);
    return {};
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.kind(), Failure::Kind::local_file);
    std::vector<std::string> errors;
    for (const auto& [pointer, detail] : failure.errors()) errors.push_back(pointer + ": " + detail);
    return errors;
  }
}

TEST_F(SceneFiles, TakesAFileAsWhatItIs) {
  write("mesh.dat", "ply\n");
  write("text.txt", "v 0 0 0\n");
  write("named.obj", "ply\n");
  write("vague.obj", "# nothing\n");
  write("given", "anything");
  json document = json::array({file_object("mesh.dat"), file_object("text.txt"), file_object("named.obj"),
                               file_object("vague.obj"), file_object("given")});
  document[4]["format"] = "nff";
  const NamedFiles found = name_files_by_content(document, {.folder = folder_});
  const char* const formats[] = {"ply", "obj", "ply", "obj", "nff"};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(document[i]["format"], formats[i]) << i;
  EXPECT_EQ(found.notes, std::vector<std::string>{"named.obj is a PLY file and is read as one"});
}

TEST_F(SceneFiles, RefusesFilesThatAreOfNoUse) {
  write("scene.fbx", "Kaydara FBX Binary  ");
  write("model.obj", "\x89PNG\r\n\x1A\n");
  write("mesh.dat", "ply?");
  const json document{{"a/b", file_object("scene.fbx")}, {"c", {file_object("model.obj"), file_object("mesh.dat")}}};
  EXPECT_EQ(refusal(document, {.folder = folder_}),
            (std::vector<std::string>{
                "/a~1b/path: scene.fbx is an FBX file; known are glTF, OBJ, PLY, STL and NFF",
                "/c/0/path: model.obj is a PNG image; known are glTF, OBJ, PLY, STL and NFF",
                "/c/1/path: mesh.dat is a file of no kind that is known here; known are glTF, OBJ, PLY, STL and NFF"}));
}

TEST_F(SceneFiles, SendsNothingFromOutsideTheFolder) {
  const auto secret = write("secret.ply", "ply secret");
  write("in/a.ply", "ply a");
  std::filesystem::create_symlink(secret, folder_ / "in/link.ply");
  std::filesystem::create_symlink("a.ply", folder_ / "in/inner.ply");
  std::filesystem::create_symlink(folder_, folder_ / "in/up");
  const SceneFolder in{.folder = folder_ / "in"};
  for (const std::string& path : {secret.string(), std::string("../secret.ply"), std::string("./x/../../secret.ply"),
                                  std::string("link.ply"), std::string("up/secret.ply")}) {
    std::filesystem::create_directories(folder_ / "in/x");
    EXPECT_EQ(
        refusal(file_object(path), in),
        std::vector<std::string>{"/path: " + path + " lies outside the document's folder; --allow-outside lets it"});
    json document = file_object(path);
    SceneFolder open = in;
    open.allow_outside = true;
    EXPECT_EQ(name_files_by_content(document, open).to_upload.size(), 1U) << path;
  }
  for (const char* path : {"a.ply", "./a.ply", "x/../a.ply", "inner.ply", "../in/a.ply"})
    EXPECT_TRUE(refusal(file_object(path), in).empty()) << path;
  EXPECT_TRUE(refusal(file_object("link.ply"), {.folder = in.folder, .named = {in.folder / "link.ply"}}).empty())
      << "what the user names";
}

TEST_F(SceneFiles, LeavesLibrariesOutsideTheFolder) {
  write("secret.mtl", "secret");
  write("in/sub/a.obj", "mtllib ../../secret.mtl\nmtllib ../b.mtl\nmtllib link.mtl\n");
  write("in/b.mtl", "b");
  std::filesystem::create_symlink(folder_ / "secret.mtl", folder_ / "in/sub/link.mtl");
  json document = file_object("sub/a.obj");
  NamedFiles found = name_files_by_content(document, {.folder = folder_ / "in"});
  EXPECT_EQ(document["companions"], json({{"../b.mtl", proto::content_hash("b")}}));
  ASSERT_EQ(found.notes.size(), 2U);
  for (const std::string& note : found.notes) EXPECT_NE(note.find("--allow-outside lets it"), std::string::npos);

  document = file_object("sub/a.obj");
  found = name_files_by_content(document, {.folder = folder_ / "in", .allow_outside = true});
  EXPECT_EQ(document["companions"].size(), 3U);
  EXPECT_TRUE(found.notes.empty());
}

TEST_F(SceneFiles, FallsBackToALibraryBesideTheObj) {
  const auto outside = write("out/model.mtl", "outside");
  write("in/a.obj", "mtllib " + outside.string() + "\nmtllib C:\\bob\\other.mtl\n");
  write("in/model.mtl", "inside");
  write("in/other.mtl", "other");
  json document = file_object("a.obj");
  const NamedFiles found = name_files_by_content(document, {.folder = folder_ / "in"});
  EXPECT_EQ(document["companions"],
            json({{"model.mtl", proto::content_hash("inside")}, {"other.mtl", proto::content_hash("other")}}));
  EXPECT_TRUE(found.notes.empty()) << "nothing is missing";
}

TEST_F(SceneFiles, FindsLibrariesInAnyCase) {
  write("a.obj", "mtllib Model.MTL\nmtllib textures\\Two.mtl\nmtllib exact.mtl\n");
  write("model.mtl", "one");
  write("Textures/TWO.MTL", "two");
  write("exact.mtl", "this");
  write("EXACT.mtl", "that");
  json document = file_object("a.obj");
  name_files_by_content(document, {.folder = folder_});
  EXPECT_EQ(document["companions"], json({{"Model.MTL", proto::content_hash("one")},
                                          {"textures/Two.mtl", proto::content_hash("two")},
                                          {"exact.mtl", proto::content_hash("this")}}))
      << "under the names by which the server asks";
}

}  // namespace
}  // namespace tessera::client
