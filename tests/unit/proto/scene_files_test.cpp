#include <limits>

#include <gtest/gtest.h>

#include "core/io/image_io.h"
#include "core/math/rounding.h"
#include "proto/parse.h"
#include "tests/support/scenes.h"
#include "tests/unit/proto/test_files.h"

namespace tessera::proto {
namespace {

constexpr std::string_view kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

constexpr std::string_view kObj =
    "mtllib colours.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n"
    "usemtl red\nf 1 2 3\nusemtl grey\nf 2 4 3\n";
constexpr std::string_view kMtl = "newmtl red\nKd 1 0 0\nnewmtl grey\nKd 0.5 0.5 0.5\n";
constexpr std::string_view kOtherMtl = "newmtl red\nKd 0.5 0 0\nnewmtl grey\nKd 0.25 0.25 0.25\n";

constexpr std::string_view kNff =
    "b 1 0 0\nv\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 45\nhither 1\nresolution 512 512\n"
    "l 3 4 5\nf 1 1 1 1 0 0 0 1\ns 0 0 0 1\ns 2 0 0 1\n";

ParsedScene parsed(const std::string& text, const FileSource& files) {
  auto result = parse_scene(text, files, Limits());
  if (!result) {
    for (const auto& e : result.problem().errors) ADD_FAILURE() << e.pointer << ": " << e.detail;
    ADD_FAILURE() << result.problem().detail;
    return {std::make_shared<const Scene>(), ""};
  }
  return *result;
}

std::string objects(const std::string& list) { return R"({"objects": [)" + list + "]}"; }

/// Of the first object.
std::string warnings_of(const ParsedScene& scene) {
  std::string text;
  for (const SceneWarning& warning : scene.scene->warnings)
    if (warning.pointer == "/objects/0") text += warning.detail + "\n";
  return text;
}

TEST(SceneFiles, CompanionsAreFoundInAnyCaseWhereThatIsClear) {
  TestFiles files;
  const ContentHash model = files.add_blob(kObj), mtl = files.add_blob(kMtl), other = files.add_blob(kOtherMtl);
  const auto with = [&](const std::string& companions) {
    return parsed(
        objects(R"({"type": "file", "format": "obj", "blob": ")" + model + R"(", "companions": {)" + companions + "}}"),
        files);
  };
  const auto red = [](const ParsedScene& scene) {
    return std::get<WhittedSurface>(scene.scene->materials[scene.scene->objects.at(0).material].surface).diffuse.r;
  };
  const auto named = [](const std::string& name, const ContentHash& hash) {
    return '"' + name + R"(": ")" + hash + '"';
  };
  // As it is written, in a folder's stead without it, and in other cases.
  const auto exact = with(named("colours.mtl", mtl) + ", " + named("Colours.MTL", other));
  EXPECT_EQ(red(exact), 1);
  EXPECT_EQ(warnings_of(exact), "The file doesn't ask for its companion \"Colours.MTL\".\n");
  const auto anyhow = with(named("COLOURS.mtl", mtl));
  EXPECT_EQ(red(anyhow), 1);
  EXPECT_EQ(warnings_of(anyhow),
            "Companions are found whose names aren't written as the file writes them: \"colours.mtl\" is "
            "\"COLOURS.mtl\".\n");
  const auto which = with(named("COLOURS.mtl", mtl) + ", " + named("Colours.MTL", other));
  EXPECT_EQ(warnings_of(which),
            "The file doesn't ask for its companion \"COLOURS.mtl\".\n"
            "The file doesn't ask for its companion \"Colours.MTL\".\n");
}

TEST(SceneFiles, AFileThatIsNamedTwiceIsReadOnceAndShared) {
  TestFiles files;
  files.add_asset("sub/triangle.ply", kPly);
  const ContentHash blob = files.add_blob(kPly);
  const auto twice = parsed(objects(R"({"type": "file", "path": "sub/triangle.ply"},
    {"type": "file", "path": "sub/triangle.ply", "format": "ply", "transform": {"scale": 2}})"),
                            files);
  ASSERT_EQ(twice.scene->shapes.size(), 1U);
  ASSERT_EQ(twice.scene->objects.size(), 2U);
  EXPECT_EQ(twice.scene->objects[1].shape, 0U);
  EXPECT_EQ(std::get<TriangleMesh>(twice.scene->shapes[0]).positions,
            (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));

  const std::string by_blob = R"({"type": "file", "format": "ply", "blob": ")" + blob + "\"}";
  const auto blobs = parsed(R"({"geometries": {"t": )" + by_blob + R"(}, "objects": [)" + by_blob +
                                R"(, {"type": "instance", "of": "t"}, {"type": "instance", "of": "t"}]})",
                            files);
  EXPECT_EQ(blobs.scene->shapes.size(), 1U);
  EXPECT_EQ(blobs.scene->objects.size(), 3U);
}

/// Someone else writes a file as soon as its hash has been taken.
class ChangingFiles : public TestFiles {
 public:
  Result<SourceFile> asset(std::string_view relative_path, const std::stop_token& stop) const override {
    auto file = TestFiles::asset(relative_path, stop);
    if (file && relative_path == changing) std::ofstream(file->path, std::ios::binary) << after;
    return file;
  }

  std::string changing, after;
};

TEST(SceneFiles, AFileThatChangesWhileItIsReadIsRefused) {
  ChangingFiles files;
  files.add_asset("model.obj", kObj);
  files.add_asset("colours.mtl", kMtl);
  const std::string scene = objects(R"({"type": "file", "path": "model.obj"})");
  parsed(scene, files);
  const auto refused = [&](const std::string& name, std::string_view after) {
    files.changing = name;
    files.after = after;
    const auto result = parse_scene(scene, files, Limits());
    ASSERT_FALSE(result) << name;
    ASSERT_EQ(result.problem().errors.size(), 1U) << name;
    EXPECT_EQ(result.problem().errors[0].pointer, "/objects/0");
    EXPECT_EQ(result.problem().errors[0].detail, "The file changed while it was read; send the scene again.");
  };
  refused("colours.mtl", kOtherMtl);
  parsed(scene, files);  // Written again, but the same.
  refused("model.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  refused("model.obj", "f broken");
}

TEST(SceneFiles, PartsKeepTheFilesMaterialsUnlessTheObjectNamesOne) {
  TestFiles files;
  files.add_asset("a/model.obj", kObj);
  files.add_asset("a/colours.mtl", kMtl);
  const auto scene = parsed(R"({"materials": {"gold": {"type": "diffuse", "color": [1, 0.5, 0]}},
    "geometries": {"m": {"type": "file", "path": "a/model.obj"}}, "objects": [
    {"type": "instance", "of": "m"}, {"type": "file", "path": "a/model.obj", "material": "gold"}]})",
                            files)
                         .scene;
  ASSERT_EQ(scene->shapes.size(), 2U);
  ASSERT_EQ(scene->objects.size(), 4U);
  const auto diffuse = [&](std::size_t object) { return surface_of(*scene, object).diffuse; };
  EXPECT_EQ(diffuse(2), (Rgb{1, 0.5F, 0}));
  EXPECT_EQ(diffuse(3), (Rgb{1, 0.5F, 0}));
  EXPECT_EQ(diffuse(0).g, 0) << "red";
  EXPECT_EQ(diffuse(1).r, diffuse(1).g) << "grey";
  EXPECT_EQ(scene->objects[0].shape, scene->objects[2].shape);
}

TEST(SceneFiles, CompanionsComeFromBesideAPathOrByNameWithABlob) {
  TestFiles files;
  files.add_asset("a/model.obj", kObj);
  files.add_asset("b/model.obj", kObj);
  files.add_asset("a/colours.mtl", kMtl);
  files.add_asset("b/colours.mtl", kOtherMtl);
  const ContentHash model = files.add_blob(kObj), colours = files.add_blob(kMtl), other = files.add_blob(kOtherMtl);
  const auto blob = [&](const ContentHash& mtl) {
    return R"({"type": "file", "format": "obj", "blob": ")" + model + R"(", "companions": {"colours.mtl": ")" + mtl +
           "\"}}";
  };
  const auto red = [&](const std::string& list, std::size_t object) {
    const auto scene = parsed(objects(list), files).scene;
    return surface_of(*scene, object).diffuse.r;
  };
  const float full = red(R"({"type": "file", "path": "a/model.obj"})", 0);
  const float half = red(R"({"type": "file", "path": "b/model.obj"})", 0);
  EXPECT_NE(full, half);
  EXPECT_EQ(red(blob(colours), 0), full);
  EXPECT_EQ(red(blob(other), 0), half);
  // The same model under two sets of companions is not one.
  EXPECT_EQ(red(blob(colours) + ", " + blob(other), 2), half);
  EXPECT_EQ(red(R"({"type": "file", "path": "a/model.obj"}, {"type": "file", "path": "b/model.obj"})", 2), half);
}

TEST(SceneFiles, CompanionsThatAreMissingOrUselessAreWarnings) {
  TestFiles files;
  const ContentHash model = files.add_blob(kObj), note = files.add_blob("hello");
  const std::string start =
      R"({"lights": [{"type": "ambient", "radiance": [1, 1, 1]}], "objects": [{"type": "file", "format": "obj", "blob": ")" +
      model;
  const auto without = parsed(start + "\"}]}", files);
  EXPECT_FALSE(without.scene->warnings.empty());
  const auto useless = parsed(start + R"(", "companions": {"note.txt": ")" + note + "\"}}]}", files);
  ASSERT_EQ(useless.scene->warnings.size(), without.scene->warnings.size() + 1);
  EXPECT_EQ(useless.scene->warnings.back().pointer, "/objects/0");
  EXPECT_NE(useless.scene->warnings.back().detail.find("note.txt"), std::string::npos);
}

TEST(SceneFiles, AnMtlLibraryOutsideTheAssetRootIsNotThere) {
  TestFiles files;
  files.add_asset("climbing.obj",
                  "mtllib ../../../../etc/passwd\nmtllib /etc/passwd\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const auto scene = parsed(objects(R"({"type": "file", "path": "climbing.obj"})"), files).scene;
  EXPECT_EQ(scene->objects.size(), 1U);
  EXPECT_FALSE(scene->warnings.empty());
}

TEST(SceneFiles, AnMtlLibraryIsFoundUnderTheAssetRootHoweverItIsNamed) {
  for (const char* name : {"../colours.mtl", "..\\colours.mtl", "./x/../../colours.mtl", "/home/bob/beside.mtl",
                           "C:\\bob\\beside.mtl", "../../../beside.mtl", "\"beside.mtl\""}) {
    TestFiles files;
    files.add_asset("a/model.obj", "MTLLIB " + std::string(name) + std::string(kObj.substr(kObj.find('\n'))));
    files.add_asset("colours.mtl", kMtl);
    files.add_asset("a/beside.mtl", kMtl);
    const auto scene = parsed(objects(R"({"type": "file", "path": "a/model.obj"})"), files).scene;
    EXPECT_EQ(scene->warnings.size(), 1U) << name << ": of the darkness alone";
  }
}

TEST(SceneFiles, ABrokenFileIsSaidOnceWithItsLine) {
  TestFiles files;
  files.add_asset("broken.ply", "ply\nformat ascii 1.0\nnonsense\n");
  const auto result = parse_scene(
      objects(R"({"type": "file", "path": "broken.ply"}, {"type": "file", "path": "broken.ply"})"), files, Limits());
  ASSERT_FALSE(result);
  EXPECT_EQ(result.problem().code, ProblemCode::invalid_document);
  ASSERT_EQ(result.problem().errors.size(), 1U);
  EXPECT_TRUE(result.problem().errors[0].pointer.starts_with("broken.ply")) << result.problem().errors[0].pointer;
}

TEST(SceneFiles, AnNffBringsWhatTheDocumentLacks) {
  TestFiles files;
  files.add_asset("scene.nff", kNff);
  const auto whole = parsed(objects(R"({"type": "file", "path": "scene.nff"})"), files).scene;
  EXPECT_EQ(whole->objects.size(), 2U);
  EXPECT_EQ(whole->background.r, 1);
  EXPECT_EQ(std::get<PerspectiveCamera>(whole->camera.value()).view.from, (Vec3{0, 0, 5}));
  const std::size_t nff_lights = whole->lights.size();
  EXPECT_GE(nff_lights, 1U);

  const auto mixed = parsed(R"({"objects": [{"type": "file", "path": "scene.nff"}], "background": [0, 0, 1],
    "camera": {"type": "orthographic", "from": [0, 0, 9], "at": [0, 0, 0], "height": 3},
    "lights": [{"type": "ambient", "radiance": [0.125, 0, 0]}]})",
                            files)
                         .scene;
  EXPECT_EQ(mixed->background, (Rgb{0, 0, 1}));
  EXPECT_EQ(std::get<OrthographicCamera>(mixed->camera.value()).height, 3);
  ASSERT_EQ(mixed->lights.size(), nff_lights + 1);
  EXPECT_EQ(std::get<AmbientLight>(mixed->lights[0]).radiance.r, 0.125F) << "the document's lights come first";
}

TEST(SceneFiles, AnNffsResolutionSizesTheImageOfAJobWithoutOne) {
  TestFiles files;
  std::string nff(kNff);
  nff.replace(nff.find("512 512"), 7, "640 480");
  files.add_asset("scene.nff", nff);
  const std::string scene = objects(R"({"type": "file", "path": "scene.nff"})");
  EXPECT_EQ(parsed(scene, files).scene->image, (ImageSize{640, 480}));

  Limits limits;
  const auto job = [&](const std::string& rest) {
    return parse_job("{\"scene\": " + scene + rest + "}", files, limits);
  };
  const auto sized = job("");
  ASSERT_TRUE(sized);
  EXPECT_EQ(sized->settings.width, 640U);
  EXPECT_EQ(sized->settings.height, 480U);
  const auto own = job(R"(, "image": {"width": 9, "height": 8})");
  ASSERT_TRUE(own);
  EXPECT_EQ(own->settings.width, 9U);

  limits.max_samples = 640 * 480 * 4;
  EXPECT_TRUE(job(R"(, "settings": {"samples": 4})"));
  const auto many = job(R"(, "settings": {"samples": 5})");
  ASSERT_FALSE(many);
  EXPECT_EQ(many.problem().errors.at(0).pointer, "/settings/samples");

  limits.max_pixels = 640 * 480 - 1;
  const auto large = job("");
  ASSERT_TRUE(large);
  EXPECT_EQ(large->settings.width, 512U) << "a size beyond the limit isn't taken, and told";
  const auto& warnings = std::get<ParsedScene>(large->scene).scene->warnings;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].pointer, "/objects/0");
  EXPECT_NE(warnings[0].detail.find("307200 pixels"), std::string::npos);
}

/// Somebody gives up while files are looked for.
class AbandonedFiles : public TestFiles {
 public:
  Result<SourceFile> asset(std::string_view relative_path, const std::stop_token& stop) const override {
    source.request_stop();
    return TestFiles::asset(relative_path, stop);
  }

  mutable std::stop_source source;
};

TEST(SceneFiles, StopsWhileFilesAreHashed) {
  AbandonedFiles files;
  files.add_asset("triangle.ply", kPly);
  EXPECT_THROW(
      parse_scene(objects(R"({"type": "file", "path": "triangle.ply"})"), files, Limits(), files.source.get_token()),
      Abandoned);
}

TEST(SceneFiles, AFileLargerThanTheSceneMayBeIsRefusedUnread) {
  TestFiles files;
  files.add_asset("triangle.ply", std::string(kPly) + std::string(5000, '\n'));
  Limits limits;
  limits.max_scene_bytes = 2000;
  const auto result = parse_scene(objects(R"({"type": "file", "path": "triangle.ply"})"), files, limits);
  ASSERT_FALSE(result);
  ASSERT_EQ(result.problem().errors.size(), 1U);
  EXPECT_EQ(result.problem().errors[0].pointer, "/objects/0");
}

/// An environment's map as an EXR.
std::string map_file(const std::vector<Rgb>& texels, std::int32_t width) {
  Pixels pixels({0, 0, width, static_cast<std::int32_t>(texels.size()) / width}, {});
  pixels.color = texels;
  const auto file = encode(pixels, kColorPlane, {.format = ImageFormat::exr}).value();
  return {reinterpret_cast<const char*>(file.data()), file.size()};
}

std::string sky(const std::string& rest) {
  return R"({"objects": [], "lights": [{"type": "environment", )" + rest + "}]}";
}

TEST(SceneFiles, AnEnvironmentHasAMap) {
  TestFiles files;
  const std::vector<Rgb> texels{{1, 2, 3}, {0, 0, 0}, {0.5F, 1000, 0}, {4, 5, 6}};
  files.add_asset("sky.exr", map_file(texels, 2));
  const ContentHash blob = files.add_blob(map_file(texels, 2));
  const auto by_path = parsed(sky(R"("path": "sky.exr")"), files),
             by_blob = parsed(sky(R"("blob": ")" + blob + '"'), files);
  EXPECT_EQ(by_path.hash, by_blob.hash) << "the content counts, not the way to it";
  for (const ParsedScene& scene : {by_path, by_blob}) {
    const auto& light = std::get<EnvironmentLight>(scene.scene->lights.at(0));
    ASSERT_TRUE(light.map);
    EXPECT_EQ(light.map->width, 2U);
    EXPECT_EQ(light.map->height, 2U);
    EXPECT_EQ(light.map->texels, texels);
    EXPECT_EQ(light.to_world, (std::array<float, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1}));
  }
  EXPECT_GE(memory_bytes(*by_path.scene), memory_bytes(Scene()) + 4 * sizeof(Rgb));
  const auto other = parsed(sky(R"("blob": ")" + files.add_blob(map_file({{1, 1, 1}, {1, 1, 1}}, 2)) + '"'), files);
  EXPECT_NE(other.hash, by_blob.hash);
  EXPECT_NE(parsed(sky(R"("path": "sky.exr", "radiance": [2, 2, 2])"), files).hash, by_path.hash);
}

TEST(SceneFiles, AnEnvironmentIsTurned) {
  TestFiles files;
  files.add_asset("sky.exr", map_file({{1, 2, 3}, {0, 0, 0}}, 2));
  const auto turned =
      parsed(sky(R"("path": "sky.exr", "transform": {"rotate": {"axis": [0, 1, 0], "degrees": 90}})"), files);
  // What was −z is now −x.
  EXPECT_EQ(std::get<EnvironmentLight>(turned.scene->lights.at(0)).to_world,
            (std::array<float, 9>{0, 0, 1, 0, 1, 0, -1, 0, 0}));
}

TEST(SceneFiles, AMapThatCannotBeLightIsRefused) {
  TestFiles files;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (const float bad : {kNan, -1.0F, 2e18F, kInfinity, -kInfinity}) {
    files.add_asset("sky.exr", map_file({{1, 2, 3}, {0, bad, 0}}, 2));
    const auto result = parse_scene(sky(R"("path": "sky.exr")"), files, Limits());
    ASSERT_FALSE(result) << bad;
    ASSERT_EQ(result.problem().errors.size(), 1U);
    EXPECT_EQ(result.problem().errors[0].pointer, "/lights/0/path");
    EXPECT_TRUE(result.problem().errors[0].detail.ends_with(".")) << result.problem().errors[0].detail;
  }
  const std::string good = map_file(std::vector<Rgb>(64, {1, 2, 3}), 8);
  for (const std::string& broken :
       {std::string(), std::string("no image"), good.substr(0, 20), good.substr(0, good.size() / 2)}) {
    files.add_asset("sky.exr", broken);
    const auto result = parse_scene(sky(R"("path": "sky.exr")"), files, Limits());
    ASSERT_FALSE(result) << broken.size();
    EXPECT_EQ(result.problem().code, ProblemCode::invalid_document);
    EXPECT_EQ(result.problem().errors.at(0).pointer, "/lights/0/path");
  }
}

TEST(SceneFiles, AMapCountsAsTheScenesMemory) {
  TestFiles files;
  files.add_asset("sky.exr", map_file(std::vector<Rgb>(64, {1, 2, 3}), 8));
  Limits limits;
  limits.max_scene_bytes = 64 * sizeof(Rgb);
  EXPECT_TRUE(parse_scene(sky(R"("path": "sky.exr")"), files, limits));
  --limits.max_scene_bytes;
  const auto result = parse_scene(sky(R"("path": "sky.exr")"), files, limits);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.problem().errors.at(0).pointer, "/lights/0/path");
}

TEST(SceneFiles, AMapThatChangesWhileItIsReadIsRefused) {
  ChangingFiles files;
  files.add_asset("sky.exr", map_file({{1, 2, 3}, {0, 0, 0}}, 2));
  files.changing = "sky.exr";
  files.after = map_file({{1, 2, 3}, {0, 0, 1}}, 2);
  const auto result = parse_scene(sky(R"("path": "sky.exr")"), files, Limits());
  ASSERT_FALSE(result);
  EXPECT_EQ(result.problem().errors.at(0).pointer, "/lights/0/path");
  EXPECT_NE(result.problem().errors.at(0).detail.find("changed"), std::string::npos);
}

}  // namespace
}  // namespace tessera::proto
