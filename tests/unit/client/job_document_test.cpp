#include "client/job_document.h"

#include <nlohmann/json.hpp>

#include "client/failure.h"
#include "tests/unit/client/temporary_folder.h"

namespace tessera::client {
namespace {

using nlohmann::json;

class JobDocument : public TemporaryFolder {
 protected:
  std::string refusal_of(const std::string& text) const {
    try {
      job_document(write("scene.json", text), {});
      return "";
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.kind(), Failure::Kind::local_file);
      return failure.what();
    }
  }
};

TEST_F(JobDocument, WrapsAScene) {
  const json job = job_document(write("room.json", R"({"objects": []})"), {});
  EXPECT_EQ(job, json({{"scene", {{"objects", json::array()}}}, {"name", "room.json"}, {"settings", json::object()}}));
}

TEST_F(JobDocument, KeepsAJobAndOverridesWhatOptionsSay) {
  const auto path = write("job.json", R"({"scene": "sha256:0", "name": "mine", "image": {"width": 1, "height": 2},
                                          "settings": {"samples": 4, "jitter": false}})");
  JobOptions options;
  options.size = {{640, 480}};
  options.samples = 16;
  options.accel = "bvh,leaf_size=2";
  options.tile_size = "32";
  options.aovs = {"depth"};
  options.count_tests = true;
  const json job = job_document(path, options);
  EXPECT_EQ(job["name"], "mine");
  EXPECT_EQ(job["image"], json({{"width", 640}, {"height", 480}}));
  EXPECT_EQ(job["settings"], json({{"samples", 16},
                                   {"jitter", false},
                                   {"accel", {{"kind", "bvh"}, {"leaf_size", 2}}},
                                   {"tile_size", 32},
                                   {"aovs", {"depth"}},
                                   {"count_tests", true}}));
}

TEST_F(JobDocument, SaysHowAndUntilWhenToRender) {
  JobOptions options;
  options.integrator = "path";
  options.sampler = "sobol";
  options.transparent = true;
  options.error = 0.01;
  const auto settings = [&](const char* document) {
    return job_document(write("job.json", document), options)["settings"];
  };
  const json common{{"integrator", "path"}, {"sampler", "sobol"}, {"transparent", true}};
  const auto until = [&](const json& expected) {
    json all = common;
    all["until"] = expected;
    return all;
  };
  EXPECT_EQ(settings(R"({"objects": []})"), until({{"error", 0.01}}));
  EXPECT_EQ(settings(R"({"scene": {}, "settings": {"samples": 64}})"), until({{"error", 0.01}, {"samples", 64}}))
      << "the server takes the samples in one place only";
  EXPECT_EQ(settings(R"({"scene": {}, "settings": {"until": {"seconds": 5, "error": 1}}})"),
            until({{"error", 0.01}, {"seconds", 5}}));
  options.seconds = 2.5;
  options.samples = 8;
  EXPECT_EQ(settings(R"({"scene": {}, "settings": {"samples": 64}})"),
            until({{"error", 0.01}, {"samples", 8}, {"seconds", 2.5}}));
  options.error.reset();
  options.seconds.reset();
  EXPECT_EQ(settings(R"({"scene": {}, "settings": {"until": {"error": 1}}})"), until({{"error", 1}, {"samples", 8}}));
}

TEST_F(JobDocument, LeavesSamplesThatStandTwiceToTheServer) {
  JobOptions options;
  options.error = 0.01;
  const json job =
      job_document(write("job.json", R"({"scene": {}, "settings": {"samples": 3, "until": {"samples": 4}}})"), options);
  EXPECT_EQ(job["settings"], json({{"samples", 3}, {"until", {{"samples", 4}, {"error", 0.01}}}}));
}

TEST_F(JobDocument, NamesTileSizesAsTheWireDoes) {
  JobOptions options;
  options.tile_size = "whole";
  EXPECT_EQ(job_document(write("scene.json", "{}"), options)["settings"]["tile_size"], "whole");
}

TEST_F(JobDocument, LightsAMeshButNotAnNffFile) {
  const auto path = write("some/where/bunny.PLY", "ply");
  const json mesh = job_document(path, {});
  EXPECT_EQ(mesh["scene"]["objects"], json::array({{{"type", "file"}, {"path", "bunny.PLY"}}}));
  EXPECT_EQ(mesh["scene"]["lights"].size(), 2U);
  EXPECT_EQ(mesh["name"], "bunny.PLY");
  EXPECT_EQ(folder_of(path), path.parent_path());
  EXPECT_FALSE(job_document(write("tetra.nff", "v"), {})["scene"].contains("lights"));
}

TEST_F(JobDocument, RefusesWhatIsNoDocument) {
  EXPECT_NE(refusal_of("{\"objects\": [}").find("column 14"), std::string::npos) << refusal_of("{\"objects\": [}");
  EXPECT_NE(refusal_of("[]").find("objects"), std::string::npos);
  EXPECT_NE(refusal_of("").find("isn't JSON"), std::string::npos);
  EXPECT_NE(refusal_of(std::string(200000, '[')).find("nests deeper"), std::string::npos);
  EXPECT_NE(refusal_of(R"({"objects": [{"type": "sphere"}], "objects": []})").find("\"objects\" stands more than once"),
            std::string::npos);
  EXPECT_NO_THROW(job_document(write("same.json", R"({"lights": [{"a": {"a": 1}}, {"a": 2}], "a": 3})"), {}));
  EXPECT_THROW(job_document("/no/such/scene.json", {}), Failure);
  EXPECT_THROW(job_document("/no/such/mesh.ply", {}), Failure);
  EXPECT_THROW(job_document(folder_, {}), Failure);
}

TEST_F(JobDocument, GoesByContent) {
  const json mesh = job_document(write("mesh.txt", "v 0 0 0\n"), {});
  EXPECT_EQ(mesh["scene"]["objects"][0]["path"], "mesh.txt");
  EXPECT_TRUE(job_document(write("model.obj", R"({"objects": []})"), {})["scene"]["objects"].empty());
  EXPECT_EQ(job_document(write("vague.nff", "# nothing\n"), {})["scene"]["objects"][0]["path"], "vague.nff");

  const auto told = [&](const char* name, const std::string& bytes, const char* what) {
    try {
      job_document(write(name, bytes), {});
      ADD_FAILURE() << name;
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.kind(), Failure::Kind::local_file);
      EXPECT_EQ(failure.what(),
                (folder_ / name).string() + " is " + what + "; known are JSON documents, OBJ, PLY, STL and NFF");
    }
  };
  told("scene.gltf", R"({"asset": {"version": "2.0"}, "scenes": []})", "a glTF file");
  told("scene.json", R"({"buffers": [")" + std::string(100000, 'A') + R"("], "accessors": []})", "a glTF file");
  told("a.off", "OFF\n3 1 0\n", "an OFF file");
  told("image.obj", "\x89PNG\r\n\x1A\n", "a PNG image");
  told("notes.txt", "hello\n", "a file of no kind that is known here");
  told("empty", "", "a file of no kind that is known here");
}

TEST_F(JobDocument, LeavesSettingsOfAWrongTypeToTheServer) {
  JobOptions options;
  options.samples = 4;
  const json job = job_document(write("job.json", R"({"scene": {}, "settings": 3})"), options);
  EXPECT_EQ(job["settings"], 3);
}

TEST(ParseSize, TakesTwoNumbers) {
  const auto size = parse_size("640x480");
  ASSERT_TRUE(size);
  EXPECT_EQ(size->width, 640U);
  EXPECT_EQ(size->height, 480U);
  for (const char* text : {"", "640", "640x", "x480", "640X480", "640x480x", "-1x2", "1x99999999999", " 1x1"})
    EXPECT_FALSE(parse_size(text)) << text;
}

}  // namespace
}  // namespace tessera::client
