#include <numbers>
#include <stop_token>

#include <gtest/gtest.h>

#include "proto/parse.h"
#include "tests/unit/proto/test_files.h"

namespace tessera::proto {
namespace {

const std::string kHash = "sha256:" + std::string(64, '7');
const std::string kByHash = "{\"scene\": \"" + kHash + '"';

JobRequest parsed_job(const std::string& text) {
  const auto job = parse_job(text, NoFiles(), Limits());
  if (!job) {
    ADD_FAILURE() << job.problem().detail << job.problem().errors.at(0).pointer << job.problem().errors.at(0).detail;
    return {};
  }
  return *job;
}

Scene sized(std::uint32_t width, std::uint32_t height) {
  Scene scene;
  scene.image = ImageSize{width, height};
  return scene;
}

TEST(ParseJob, DefaultsAreThoseOfCore) {
  const JobRequest job = parsed_job(kByHash + "}");
  EXPECT_EQ(std::get<ContentHash>(job.scene), kHash);
  EXPECT_FALSE(job.camera);
  EXPECT_EQ(job.name, "");
  EXPECT_EQ(job.priority, Priority::normal);
  const Settings defaults;
  EXPECT_EQ(job.settings.width, defaults.width);
  EXPECT_EQ(job.settings.height, defaults.height);
  EXPECT_EQ(job.settings.samples, defaults.samples);
  EXPECT_EQ(job.settings.jitter, defaults.jitter);
  EXPECT_EQ(job.settings.max_depth, defaults.max_depth);
  EXPECT_EQ(job.settings.seed, defaults.seed);
  EXPECT_EQ(job.settings.accel, defaults.accel);
  EXPECT_EQ(job.settings.screen_bounds, defaults.screen_bounds);
  EXPECT_EQ(job.settings.tile_size, defaults.tile_size);
  EXPECT_EQ(job.settings.aovs, defaults.aovs);
  EXPECT_EQ(job.settings.count_tests, defaults.count_tests);
}

TEST(ParseJob, EverySetting) {
  const JobRequest job =
      parsed_job(kByHash + R"(, "name": "übung", "priority": "high", "webhook": "https://hooks.example.org/",
    "image": {"width": 640, "height": 480},
    "camera": {"type": "orthographic", "from": [0, 0, 1], "at": [0, 0, 0], "height": 3},
    "settings": {"samples": 16, "jitter": false, "max_depth": 9, "seed": 18446744073709551615,
                 "accel": {"kind": "brute"}, "screen_bounds": "off", "tile_size": 32,
                 "aovs": ["object_id", "depth"], "count_tests": true}})");
  EXPECT_EQ(job.name, "übung");
  EXPECT_EQ(job.priority, Priority::high);
  EXPECT_EQ(job.webhook, "https://hooks.example.org/");
  EXPECT_EQ(std::get<OrthographicCamera>(job.camera.value()).height, 3);
  EXPECT_EQ(job.settings.width, 640U);
  EXPECT_EQ(job.settings.height, 480U);
  EXPECT_EQ(job.settings.samples, 16U);
  EXPECT_FALSE(job.settings.jitter);
  EXPECT_EQ(job.settings.max_depth, 9U);
  EXPECT_EQ(job.settings.seed, 18446744073709551615U);
  EXPECT_EQ(job.settings.accel.kind, AccelKind::brute);
  EXPECT_EQ(job.settings.screen_bounds, ScreenBounds::off);
  EXPECT_EQ(job.settings.tile_size, 32U);
  EXPECT_EQ(job.settings.aovs, (std::set<Aov>{Aov::depth, Aov::object_id}));
  EXPECT_TRUE(job.settings.count_tests);
}

TEST(ParseJob, SettingsOfLight) {
  const auto settings = [](const std::string& text) {
    return parsed_job(kByHash + R"(, "settings": {)" + text + "}}").settings;
  };
  const Settings defaults = settings("");
  EXPECT_EQ(defaults.integrator, IntegratorKind::automatic);
  EXPECT_EQ(defaults.sampler, SamplerKind::automatic);
  EXPECT_EQ(defaults.filter, FilterKind::box);
  EXPECT_EQ(defaults.filter_width, 0);
  EXPECT_EQ(defaults.clamp, kInfinity);
  EXPECT_EQ(defaults.ambient_occlusion_reach, kInfinity);
  EXPECT_FALSE(defaults.error || defaults.seconds || defaults.max_depth);
  EXPECT_TRUE(defaults.adaptive);
  EXPECT_FALSE(defaults.transparent);

  const Settings path = settings(R"("integrator": "path", "sampler": "sobol", "clamp": 10, "adaptive": false,
                                    "filter": {"type": "gaussian", "width": 2.5}, "max_depth": 1, "until": {"seconds": 5})");
  EXPECT_EQ(path.integrator, IntegratorKind::path);
  EXPECT_EQ(path.sampler, SamplerKind::sobol);
  EXPECT_EQ(path.filter, FilterKind::gaussian);
  EXPECT_EQ(path.filter_width, 2.5F);
  EXPECT_EQ(path.clamp, 10);
  EXPECT_FALSE(path.adaptive);
  EXPECT_EQ(path.max_depth, 1U);
  EXPECT_EQ(settings(R"("integrator": "direct", "max_depth": 2)").integrator, IntegratorKind::direct);
  EXPECT_EQ(settings(R"("integrator": "whitted", "sampler": "grid")").sampler, SamplerKind::grid);
  const Settings occlusion =
      settings(R"("integrator": "ambient_occlusion", "ambient_occlusion_distance": 2, "sampler": "independent")");
  EXPECT_EQ(occlusion.integrator, IntegratorKind::ambient_occlusion);
  EXPECT_EQ(occlusion.ambient_occlusion_reach, 2);
  EXPECT_EQ(occlusion.sampler, SamplerKind::independent);
  EXPECT_EQ(settings(R"("filter": {"type": "blackman_harris"})").filter, FilterKind::blackman_harris);
}

TEST(ParseJob, ATransparentImageRecordsItsAlpha) {
  const auto settings = [](const std::string& text) {
    return parsed_job(kByHash + R"(, "settings": {)" + text + "}}").settings;
  };
  EXPECT_TRUE(settings(R"("transparent": true)").transparent);
  EXPECT_EQ(settings(R"("transparent": true)").aovs, std::set<Aov>{Aov::alpha});
  EXPECT_EQ(settings(R"("transparent": true, "aovs": ["alpha", "depth"])").aovs,
            (std::set<Aov>{Aov::alpha, Aov::depth}));
  EXPECT_TRUE(settings(R"("transparent": false)").aovs.empty());
}

TEST(ParseJob, UntilAnyOrAll) {
  const auto settings = [](const std::string& until) {
    return parsed_job(kByHash + R"(, "image": {"width": 16, "height": 4}, "settings": {"until": )" + until + "}}")
        .settings;
  };
  const Settings all = settings(R"({"samples": 64, "error": 0.25, "seconds": 2.5})");
  EXPECT_EQ(all.samples, 64U);
  EXPECT_EQ(all.error, 0.25F);
  EXPECT_EQ(all.seconds, 2.5);
  EXPECT_EQ(settings(R"({"samples": 64})").samples, 64U);
  EXPECT_FALSE(settings(R"({"samples": 64})").error);
  // Where no samples are given, as many as the server takes of an image of this size.
  EXPECT_EQ(settings(R"({"error": 0.5})").samples, (1ULL << 36) / 64);
  EXPECT_EQ(settings(R"({"seconds": 1})").samples, (1ULL << 36) / 64);
}

TEST(ParseJob, SamplesWithoutAnEndAreTheLimitOfTheSizeOfItsScene) {
  Limits limits;
  limits.max_samples = 640 * 480 * 10;
  JobRequest job = parsed_job(kByHash + R"(, "settings": {"until": {"error": 0.1}}})");
  EXPECT_FALSE(fit_to_scene(sized(640, 480), limits, job));
  EXPECT_EQ(job.settings.samples, 10U);
}

/// The one error that a scene and settings meet, whether the scene comes inline or by its hash; empty when there is
/// none.
std::string refused(const std::string& scene, const std::string& settings) {
  const auto place = [](const Problem& problem, std::string_view prefix) {
    EXPECT_EQ(problem.code, ProblemCode::invalid_document);
    EXPECT_EQ(problem.errors.size(), 1U);
    EXPECT_TRUE(problem.errors.at(0).detail.ends_with(".")) << prefix;
    return problem.errors.at(0).pointer;
  };
  const auto inline_job =
      parse_job("{\"scene\": " + scene + ", \"settings\": {" + settings + "}}", NoFiles(), Limits());
  const std::string at = inline_job ? "" : place(inline_job.problem(), "inline");
  const auto parsed = parse_scene(scene, NoFiles(), Limits());
  auto job = parse_job(kByHash + ", \"settings\": {" + settings + "}}", NoFiles(), Limits());
  if (!parsed || !job) {
    ADD_FAILURE() << "only together they are refused: " << scene << settings;
    return at;
  }
  const auto problem = fit_to_scene(*parsed->scene, Limits(), *job);
  EXPECT_EQ(problem ? place(*problem, "by hash") : "", at) << scene << settings;
  return at;
}

std::string scene_with(const std::string& material, const std::string& light) {
  return R"({"materials": {"m": {)" + material + R"(}}, "lights": [{)" + light +
         R"(}], "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}]})";
}
constexpr const char* kClay = R"("type": "diffuse", "color": [1, 1, 1])";
constexpr const char* kGold = R"("type": "conductor", "metal": "gold")";
constexpr const char* kPoint = R"("type": "point", "position": [0, 5, 0], "intensity": [1, 1, 1])";
constexpr const char* kAmbient = R"("type": "ambient", "radiance": [1, 1, 1])";
constexpr const char* kNoFalloff =
    R"("type": "point", "position": [0, 5, 0], "intensity": [1, 1, 1], "falloff": "none")";

TEST(ParseJob, WhittedRefusesWhatItDoesNotKnow) {
  const std::string whitted = R"("integrator": "whitted")";
  EXPECT_EQ(refused(scene_with(kClay, kPoint), whitted), "");
  EXPECT_EQ(refused(scene_with(kClay, kAmbient), whitted), "");
  EXPECT_EQ(refused(scene_with(R"("type": "dielectric", "ior": 1.5)", kNoFalloff), whitted), "");
  for (const char* material :
       {kGold, R"("type": "dielectric", "ior": 1.5, "roughness": 0.5)", R"("type": "metallic_roughness")",
        R"("type": "diffuse", "color": [1, 1, 1], "emission": [1, 1, 1])", R"("type": "whitted", "alpha": 0.5)"})
    EXPECT_EQ(refused(scene_with(material, kPoint), whitted), "/settings/integrator") << material;
  for (const char* light :
       {R"("type": "environment")", R"("type": "sun", "direction": [0, 1, 0], "irradiance": [1, 1, 1])",
        R"("type": "spot", "position": [0, 5, 0], "direction": [0, -1, 0], "intensity": [1, 1, 1], "outer_angle": 30)"})
    EXPECT_EQ(refused(scene_with(kClay, light), whitted), "/settings/integrator") << light;
}

TEST(ParseJob, PathsRefuseLightThatIsNotPhysical) {
  for (const char* integrator : {"path", "direct"}) {
    const std::string asked = R"("integrator": ")" + std::string(integrator) + '"';
    EXPECT_EQ(refused(scene_with(kClay, kPoint), asked), "");
    EXPECT_EQ(refused(scene_with(kGold, kPoint), asked), "");
    EXPECT_EQ(refused(scene_with(kClay, kAmbient), asked), "/settings/integrator");
    EXPECT_EQ(refused(scene_with(kClay, kNoFalloff), asked), "/settings/integrator");
  }
  EXPECT_EQ(refused(scene_with(kGold, kAmbient), R"("integrator": "ambient_occlusion")"), "");
}

TEST(ParseJob, AutoTakesWhatTheSceneNeeds) {
  EXPECT_EQ(refused(scene_with(kClay, kAmbient), ""), "");
  EXPECT_EQ(refused(scene_with(kGold, kPoint), ""), "");
  EXPECT_EQ(refused(scene_with(kGold, kAmbient), ""), "/settings/integrator") << "nothing renders both";
  // And then reads the settings of what it took, and no others.
  EXPECT_EQ(refused(scene_with(kClay, kPoint), R"("sampler": "grid")"), "");
  EXPECT_EQ(refused(scene_with(kGold, kPoint), R"("sampler": "grid")"), "/settings/sampler");
  EXPECT_EQ(refused(scene_with(kGold, kPoint), R"("clamp": 5)"), "");
  EXPECT_EQ(refused(scene_with(kClay, kPoint), R"("clamp": 5)"), "/settings/clamp");
}

TEST(ParseJob, WordsForStructureTilesAndAovs) {
  const auto settings = [](const std::string& text) {
    return parsed_job(kByHash + R"(, "image": {"width": 64, "height": 100}, "settings": {)" + text + "}}").settings;
  };
  EXPECT_EQ(settings(R"("accel": {"kind": "auto"})").accel.kind, AccelKind::automatic);
  EXPECT_EQ(settings(R"("accel": {"kind": "bvh"})").accel.kind, AccelKind::bvh);
  EXPECT_EQ(settings(R"("screen_bounds": "flat")").screen_bounds, ScreenBounds::flat);
  EXPECT_EQ(settings(R"("screen_bounds": "hierarchical")").screen_bounds, ScreenBounds::hierarchical);
  EXPECT_EQ(settings(R"("tile_size": "auto")").tile_size, kAdaptiveTiles);
  EXPECT_EQ(settings(R"("tile_size": "whole")").tile_size, 100U);
  EXPECT_EQ(settings(R"("tile_size": 1)").tile_size, 1U);
  EXPECT_EQ(settings(R"("aovs": ["normal", "primitive_id"])").aovs, (std::set<Aov>{Aov::normal, Aov::primitive_id}));
  EXPECT_EQ(settings(R"("aovs": ["cost_primitives", "cost_volumes"])").aovs,
            (std::set<Aov>{Aov::cost_volumes, Aov::cost_primitives}));
}

TEST(ParseJob, TheOrderOfKeysDoesNotMatter) {
  const JobRequest job = parsed_job(
      "{\"settings\": {\"tile_size\": \"whole\"}, \"image\": {\"height\": 8, \"width\": 99}, "
      "\"scene\": \"" +
      kHash + "\"}");
  EXPECT_EQ(job.settings.tile_size, 99U);
}

TEST(ParseJob, AnInlineSceneIsTheSceneThatStandsAlone) {
  const std::string text = R"({"camera": {"type": "perspective", "from": [0, 0, 5], "at": [0, 0, 0]},
    "lights": [{"type": "ambient", "radiance": [1, 1, 1]}], "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 2},
                {"type": "mesh", "positions": [], "triangles": []}]})";
  const auto alone = parse_scene(text, NoFiles(), Limits());
  ASSERT_TRUE(alone);
  const JobRequest job = parsed_job("{\"name\": \"x\", \"scene\": " + text + "}");
  const auto& scene = std::get<ParsedScene>(job.scene);
  EXPECT_EQ(scene.hash, alone->hash);
  EXPECT_EQ(std::get<Sphere>(scene.scene->shapes.at(0)).radius, 2);
  EXPECT_FALSE(job.camera) << "the scene's camera stays the scene's";
  ASSERT_EQ(scene.scene->warnings.size(), 1U);
  EXPECT_EQ(scene.scene->warnings[0].pointer, "/objects/1") << "warnings point into the scene document";
}

TEST(ParseJob, TakesTheSizeOfItsSceneUnlessItHasOne) {
  JobRequest job = parsed_job(kByHash + R"(, "settings": {"tile_size": "whole"}})");
  EXPECT_FALSE(fit_to_scene(sized(640, 480), Limits(), job));
  EXPECT_EQ(job.settings.width, 640U);
  EXPECT_EQ(job.settings.height, 480U);
  EXPECT_EQ(job.settings.tile_size, 640U);

  JobRequest own = parsed_job(kByHash + R"(, "image": {"width": 7, "height": 5}})");
  EXPECT_FALSE(fit_to_scene(sized(640, 480), Limits(), own));
  EXPECT_EQ(own.settings.width, 7U);
  EXPECT_EQ(own.settings.height, 5U);

  JobRequest none = parsed_job(kByHash + "}");
  EXPECT_FALSE(fit_to_scene(Scene(), Limits(), none));
  EXPECT_EQ(none.settings.width, 512U);

  Limits small;
  small.max_pixels = 512 * 512 - 1;
  const auto problem = fit_to_scene(Scene(), small, none);
  ASSERT_TRUE(problem);
  EXPECT_EQ(problem->errors.at(0).pointer, "/image");
}

TEST(ParseJob, LimitsHoldForTheSizeOfItsScene) {
  const auto problem = [](const std::string& settings) {
    Limits limits;
    limits.max_samples = 640 * 480 * 10;
    limits.max_tiles = 1200;
    JobRequest job = parsed_job(kByHash + ", \"settings\": {" + settings + "}}");
    return fit_to_scene(sized(640, 480), limits, job);
  };
  EXPECT_FALSE(problem(R"("samples": 10, "tile_size": 16)"));
  const auto samples = problem(R"("samples": 11)");
  ASSERT_TRUE(samples);
  EXPECT_EQ(samples->code, ProblemCode::invalid_document);
  EXPECT_EQ(samples->errors.at(0).pointer, "/settings/samples");
  const auto tiles = problem(R"("tile_size": 15)");
  ASSERT_TRUE(tiles);
  EXPECT_EQ(tiles->errors.at(0).pointer, "/settings/tile_size");
}

TEST(ParseJob, StopsWhenNobodyWantsIt) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(parse_job(kByHash + "}", NoFiles(), Limits(), stop.get_token()), Abandoned);
}

TEST(ParseJob, PixelsTilesAndSamplesAreLimited) {
  const auto refused_at = [](const std::string& rest) -> std::string {
    Limits limits;
    limits.max_pixels = 100;
    limits.max_tiles = 20;
    limits.max_samples = 1000;
    const auto job = parse_job(kByHash + rest + "}", NoFiles(), limits);
    return job ? "nowhere" : job.problem().errors.at(0).pointer;
  };
  EXPECT_EQ(refused_at(R"(, "image": {"width": 10, "height": 10})"), "nowhere");
  EXPECT_EQ(refused_at(R"(, "image": {"width": 101, "height": 1})"), "/image");
  EXPECT_EQ(refused_at(R"(, "image": {"width": 4294967295, "height": 4294967295})"), "/image");
  EXPECT_EQ(refused_at(R"(, "image": {"width": 10, "height": 9}, "settings": {"tile_size": 2})"),
            "/settings/tile_size");
  EXPECT_EQ(refused_at(R"(, "image": {"width": 10, "height": 8}, "settings": {"tile_size": 2})"), "nowhere");
  EXPECT_EQ(refused_at(R"(, "image": {"width": 10, "height": 10}, "settings": {"samples": 10})"), "nowhere");
  EXPECT_EQ(refused_at(R"(, "image": {"width": 10, "height": 10}, "settings": {"samples": 11})"), "/settings/samples");
  EXPECT_EQ(refused_at(R"(, "image": {"width": 10, "height": 10}, "settings": {"until": {"samples": 11}})"),
            "/settings/until/samples");
}

TEST(ParseJob, APixelTakesASampleAtLeast) {
  for (const char* settings : {R"({})", R"({"samples": 2})", R"({"until": {"error": 0.1}})",
                               R"({"until": {"seconds": 1}})", R"({"until": {"samples": 1}})"}) {
    const auto refused_at = [&](std::uint64_t max_samples) -> std::string {
      Limits limits;
      limits.max_samples = max_samples;
      const auto job = parse_job(kByHash + R"(, "image": {"width": 64, "height": 64}, "settings": )" + settings + "}",
                                 NoFiles(), limits);
      if (!job) return job.problem().errors.at(0).pointer;
      EXPECT_GE((*job).settings.samples, 1U);
      return "nowhere";
    };
    EXPECT_EQ(refused_at(64 * 64 * 2), "nowhere") << settings;
    EXPECT_EQ(refused_at(64 * 64 - 1), "/image") << settings;
    // Where the size is the scene's.
    Limits limits;
    limits.max_samples = 640 * 480 - 1;
    JobRequest job = parsed_job(kByHash + R"(, "settings": )" + settings + "}");
    const auto problem = fit_to_scene(sized(640, 480), limits, job);
    ASSERT_TRUE(problem);
    EXPECT_EQ(problem->errors.at(0).pointer, "/image");
  }
}

}  // namespace
}  // namespace tessera::proto
