#include "client/job_document.h"

#include <nlohmann/json.hpp>

#include "client/failure.h"
#include "tests/support/temporary_folder.h"

namespace tessera::client {
namespace {

using nlohmann::json;

class JobDocument : public FolderTest {
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

TEST_F(JobDocument, ShowsAModelAsTheOneCallDoes) {
  const auto path = write("some/where/bunny.PLY", "ply");
  const json light{{"type", "environment"}, {"preset", "studio"}, {"only_without_lights", true}};
  EXPECT_EQ(job_document(path, {}),
            json({{"name", "bunny.PLY"},
                  {"scene",
                   {{"objects", json::array({{{"type", "file"}, {"path", "bunny.PLY"}}})},
                    {"lights", json::array({light})},
                    {"ground", "shadow"}}},
                  {"camera", {{"type", "perspective"}, {"azimuth", 30}, {"elevation", 20}, {"fov", 30}}},
                  {"image", {{"width", 512}, {"height", 512}}},
                  {"settings", {{"transparent", true}, {"until", {{"error", 0.02}, {"samples", 256}}}}}}));
  EXPECT_EQ(folder_of(path), path.parent_path());
  EXPECT_EQ(job_document(write("tetra.nff", "v"), {}),
            json({{"name", "tetra.nff"},
                  {"scene", {{"objects", json::array({{{"type", "file"}, {"path", "tetra.nff"}}})}}},
                  {"settings", {{"until", {{"error", 0.02}, {"samples", 256}}}}}}));
}

TEST_F(JobDocument, TakesOptionsForModels) {
  const auto path = write("helmet.glb", "glTF");
  const auto sky = write("sky.hdr", "#?RADIANCE");
  JobOptions options;
  options.variant = "red";
  options.smooth = 30;
  options.has_z_up = true;
  options.has_no_ground = true;
  options.environment = sky.string();
  options.angles = {.azimuth = -90, .elevation = {}, .fov = 20};
  options.samples = 7;
  options.shows_environment = true;
  json job = job_document(path, options);
  const json object = job["scene"]["objects"][0];
  EXPECT_EQ(object["variant"], "red");
  EXPECT_EQ(object["smooth"], 30);
  EXPECT_EQ(object["transform"], (json{1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0}));
  EXPECT_EQ(job["scene"]["lights"], json::array({{{"type", "environment"}, {"path", sky.string()}}}));
  EXPECT_FALSE(job["scene"].contains("ground"));
  EXPECT_EQ(job["camera"], (json{{"type", "perspective"}, {"azimuth", -90}, {"elevation", 20}, {"fov", 20}}));
  EXPECT_EQ(job["settings"], (json{{"transparent", false}, {"until", {{"samples", 7}}}}));
  EXPECT_EQ(named_files(path, options), (std::vector<std::filesystem::path>{path, sky}));

  JobOptions camera;
  camera.camera = "1";
  camera.environment = "0.5";
  job = job_document(path, camera);
  EXPECT_EQ(job["scene"]["objects"][0]["file_camera"], 1);
  EXPECT_EQ(job["scene"]["lights"][0]["radiance"], (json{0.5, 0.5, 0.5}));
  EXPECT_FALSE(job.contains("camera"));
  camera.environment = "gone.hdr";
  EXPECT_THROW(job_document(path, camera), Failure);
}

TEST_F(JobDocument, RefusesOptionsForModelsThatADocumentHasNoPlaceFor) {
  JobOptions options;
  options.angles.fov = 20;
  try {
    job_document(write("scene.json", R"({"objects": []})"), options);
    ADD_FAILURE();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.kind(), Failure::Kind::usage);
    EXPECT_NE(std::string(failure.what()).find("--fov"), std::string::npos);
  }
}

TEST_F(JobDocument, OfAFileThatIsNotThereSaysThat) {
  JobOptions options;
  options.angles.fov = 20;
  try {
    job_document("nowhere.gltf", options);
    ADD_FAILURE();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.kind(), Failure::Kind::local_file) << failure.what();
  }
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
                (folder_ / name).string() + " is " + what + "; known are JSON documents, glTF, OBJ, PLY, STL and NFF");
    }
  };
  for (const char* gltf : {"scene.gltf", "other.json"})
    EXPECT_EQ(model_format(write(gltf, R"({"asset": {"version": "2.0"}, "scenes": []})")), "gltf");
  EXPECT_EQ(model_format(write("late.gltf", R"({"a": 1})")), "gltf");
  EXPECT_EQ(model_format(write("scene.json", R"({"objects": []})")), "");
  EXPECT_EQ(model_format("-"), "");
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
