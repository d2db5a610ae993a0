#include "client/scene_files.h"

#include <nlohmann/json.hpp>

#include "client/failure.h"
#include "tests/unit/client/temporary_folder.h"

namespace tessera::client {
namespace {

using nlohmann::json;
using SceneFiles = TemporaryFolder;

json file_object(const std::string& path) { return {{"type", "file"}, {"path", path}}; }

TEST_F(SceneFiles, FindsFilesAtAnyDepth) {
  const auto a = write("a.ply", "ply a");
  const auto b = write("meshes/b.PLY", "ply b");
  json job{{"scene", {{"objects", {file_object("a.ply")}}, {"geometries", {{"b", file_object("meshes/b.PLY")}}}}}};

  const NamedFiles found = name_files_by_content(job, folder_);

  const json& object = job["scene"]["objects"][0];
  EXPECT_EQ(object, json({{"type", "file"}, {"format", "ply"}, {"blob", proto::content_hash("ply a")}}));
  EXPECT_EQ(job["scene"]["geometries"]["b"]["blob"], proto::content_hash("ply b"));
  ASSERT_EQ(found.to_upload.size(), 2U);
  EXPECT_EQ(found.to_upload[0], (LocalFile{b, proto::content_hash("ply b")}));
  EXPECT_EQ(found.to_upload[1], (LocalFile{a, proto::content_hash("ply a")}));
  EXPECT_TRUE(found.left_to_server.empty());
}

TEST_F(SceneFiles, BringsTheMaterialLibrariesOfAnObj) {
  const std::string obj = "# mtllib no.mtl\nmtllib  one.mtl sub/two.mtl\r\n  mtllib missing.mtl\nv 0 0 0\n";
  write("mesh/cube.obj", obj);
  write("mesh/one.mtl", "one");
  write("mesh/sub/two.mtl", "two");
  write("mesh/no.mtl", "no");
  json document = file_object("mesh/cube.obj");

  const NamedFiles found = name_files_by_content(document, folder_);

  EXPECT_EQ(document["blob"], proto::content_hash(obj));
  EXPECT_EQ(document["companions"],
            json({{"one.mtl", proto::content_hash("one")}, {"sub/two.mtl", proto::content_hash("two")}}));
  EXPECT_EQ(found.to_upload.size(), 3U);
}

TEST_F(SceneFiles, FindsMaterialLibrariesWhereverTheyStandInALargeObj) {
  write("one.mtl", "one");
  write("two.mtl", "two");
  for (const std::size_t before : {1U << 20, (1U << 20) - 9, (1U << 20) - 1, (2U << 20) + 1}) {
    write("a.obj", std::string(before - 1, '#') + "\nmtllib one.mtl\n#\nmtllib two.mtl");
    json document = file_object("a.obj");
    name_files_by_content(document, folder_);
    EXPECT_EQ(document["companions"].size(), 2U) << before;
  }
}

TEST_F(SceneFiles, UploadsAFileOnceHoweverOftenItIsNamed) {
  write("a.ply", "ply a");
  json document = json::array({file_object("a.ply"), file_object("a.ply")});
  EXPECT_EQ(name_files_by_content(document, folder_).to_upload.size(), 1U);
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
  const NamedFiles found = name_files_by_content(document, folder_);
  EXPECT_EQ(document, before);
  EXPECT_EQ(found.left_to_server, std::vector<std::string>{"not-here.obj"});
  EXPECT_TRUE(found.to_upload.empty());
}

TEST_F(SceneFiles, LeavesAFileWhoseFormatNobodyCanTell) {
  write("mesh.dat", "ply?");
  json document = json::array({file_object("mesh.dat"), file_object("mesh.dat")});
  document[1]["format"] = "ply";
  name_files_by_content(document, folder_);
  EXPECT_EQ(document[0], file_object("mesh.dat"));
  EXPECT_EQ(document[1]["blob"], proto::content_hash("ply?"));
}

}  // namespace
}  // namespace tessera::client
