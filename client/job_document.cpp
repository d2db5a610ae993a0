#include "client/job_document.h"

#include <charconv>
#include <fstream>
#include <iostream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "client/accel_argument.h"
#include "client/failure.h"
#include "client/scene_files.h"

namespace tessera::client {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr const char* kStandardInput = "-";

// More than any server takes; less than would exhaust the stack of a program that walks the document.
constexpr int kMaxDepth = 1000;

std::string name_of(const std::string& scene) { return scene == kStandardInput ? "standard input" : scene; }

std::ifstream open(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::error_code ignored;
  if (!file || fs::is_directory(path, ignored)) throw Failure(Failure::Kind::local_file, "can't read " + path);
  return file;
}

std::string read_all(const std::string& scene) {
  std::ifstream file;
  if (scene != kStandardInput) file = open(scene);
  return {std::istreambuf_iterator<char>(scene == kStandardInput ? std::cin : file), {}};
}

[[noreturn]] void refuse_kind(const std::string& scene, proto::FileKind kind, const char* known) {
  throw Failure(Failure::Kind::local_file,
                name_of(scene) + " is " + std::string(proto::description(kind)) + "; " + known);
}

json parse_document(const std::string& text, const std::string& scene) {
  const auto refuse = [&](const std::string& why) {
    throw Failure(Failure::Kind::local_file, name_of(scene) + ": " + why);
  };
  std::vector<std::set<std::string>> keys;  // of the objects that are open: of repeated ones, only the last would stay
  const auto guard = [&](int depth, json::parse_event_t event, json& parsed) {
    using Event = json::parse_event_t;
    if (depth > kMaxDepth) refuse("nests deeper than " + std::to_string(kMaxDepth) + " levels");
    if (event == Event::object_start) keys.emplace_back();
    if (event == Event::object_end) keys.pop_back();
    if (event == Event::key && !keys.back().insert(parsed.get<std::string>()).second)
      refuse("the key " + parsed.dump() + " stands more than once in one object; keep one");
    return true;
  };
  json document;
  try {
    document = json::parse(text, guard);
  } catch (const json::exception& e) {
    refuse(std::string("isn't JSON: ") + e.what());
  }
  if (!document.is_object()) refuse("is JSON, but no scene or job: those are objects");
  return document;
}

/// What can be read only once, as a pipe can, is a document.
bool is_file(const std::string& scene) {
  std::error_code ignored;
  return scene != kStandardInput && fs::is_regular_file(scene, ignored);
}

json environment_of(const std::string& asked) {
  if (auto light = proto::environment_light(asked)) return *std::move(light);
  if (is_file(asked)) return {{"type", "environment"}, {"path", fs::absolute(asked).string()}};
  throw Failure(Failure::Kind::local_file,
                "there is no file " + asked +
                    " to be the environment; give an HDR or EXR image, studio, or a radiance as one number or three "
                    "(0.5, or 1,0.9,0.8)");
}

/// The picture that POST /v1/render makes of the file.
json model_job(const std::string& scene, const std::string& format, const JobOptions& options) {
  const proto::ModelLook look{.is_a_scene = format == "nff",
                              .camera = options.camera,
                              .variant = options.variant,
                              .smooth = options.smooth,
                              .environment = options.environment ? environment_of(*options.environment) : json(),
                              .has_z_up = options.has_z_up,
                              .has_ground = !options.has_no_ground};
  json job{{"scene", proto::model_scene(look, {{"type", "file"}, {"path", fs::path(scene).filename().string()}})}};
  if (!look.is_a_scene || options.angles.is_given())
    if (!look.camera) job["camera"] = proto::view_camera(options.angles);
  if (!look.is_a_scene) job["image"] = proto::picture_size(std::nullopt, std::nullopt);
  if (!look.is_a_scene || options.shows_environment) job["settings"]["transparent"] = !options.shows_environment;
  job["settings"]["until"] =
      proto::picture_until({.samples = options.samples, .error = options.error, .seconds = options.seconds});
  return job;
}

/// A file is what its content says.
json document_of(const std::string& scene) {
  constexpr const char* kKnown = "known are JSON documents, glTF, OBJ, PLY, STL and NFF";
  using proto::FileKind;
  const bool has_name = is_file(scene);
  if (has_name) {
    const FileKind kind = proto::file_kind(fs::path(scene));
    const bool may_be_json = kind == FileKind::json || fs::path(scene).extension() == ".json";
    if (!may_be_json) refuse_kind(scene, kind, kKnown);
  }
  const std::string text = read_all(scene);
  const FileKind kind = proto::file_kind(text, text.size());
  if (kind != FileKind::json && kind != FileKind::unknown)
    refuse_kind(scene, kind, has_name ? kKnown : "a document is expected where there is no file");
  return parse_document(text, scene);
}

json tile_size(const std::string& text) {
  std::uint32_t pixels = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), pixels);
  if (error != std::errc() || end != text.data() + text.size()) return text;
  return pixels;
}

/// A document's member that is to be an object, made when it isn't there. The server refuses what isn't one.
json* section(json& document, const char* name) {
  json& member = document[name];
  if (member.is_null()) member = json::object();
  return member.is_object() ? &member : nullptr;
}

/// When to stop, in one place: the samples of a document that has no "until" become the most where it gets one.
void apply_until(const JobOptions& options, json& settings) {
  const bool had_until = settings.contains("until");
  if (!had_until && !options.error && !options.seconds) {
    if (options.samples) settings["samples"] = *options.samples;
    return;
  }
  json* until = section(settings, "until");
  if (until == nullptr) return;
  if (!had_until && settings.contains("samples")) {
    (*until)["samples"] = settings["samples"];
    settings.erase("samples");
  }
  if (options.samples) (*until)["samples"] = *options.samples;
  if (options.error) (*until)["error"] = *options.error;
  if (options.seconds) (*until)["seconds"] = *options.seconds;
}

void apply_settings(const JobOptions& options, json& settings) {
  apply_until(options, settings);
  if (options.integrator) settings["integrator"] = *options.integrator;
  if (options.sampler) settings["sampler"] = *options.sampler;
  if (options.transparent) settings["transparent"] = true;
  if (options.max_depth) settings["max_depth"] = *options.max_depth;
  if (options.seed) settings["seed"] = *options.seed;
  if (options.accel) settings["accel"] = parse_accel(*options.accel).value();
  if (options.screen_bounds) settings["screen_bounds"] = *options.screen_bounds;
  if (options.tile_size) settings["tile_size"] = tile_size(*options.tile_size);
  if (!options.aovs.empty()) settings["aovs"] = options.aovs;
  if (options.count_tests) settings["count_tests"] = true;
}

}  // namespace

std::optional<JobOptions::Size> parse_size(std::string_view text) {
  JobOptions::Size size{};
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.width);
  if (width.ec != std::errc() || width.ptr == end || *width.ptr != 'x') return std::nullopt;
  const auto height = std::from_chars(width.ptr + 1, end, size.height);
  if (height.ec != std::errc() || height.ptr != end) return std::nullopt;
  return size;
}

std::vector<std::string> JobOptions::of_models() const {
  std::vector<std::string> names;
  const auto add = [&](const char* option, bool is_given) {
    if (is_given) names.emplace_back(option);
  };
  add("--camera", camera.has_value());
  add("--azimuth", angles.azimuth.has_value());
  add("--elevation", angles.elevation.has_value());
  add("--fov", angles.fov.has_value());
  add("--environment", environment.has_value());
  add("--variant", variant.has_value());
  add("--smooth", smooth.has_value());
  add("--up", has_z_up);
  add("--no-ground", has_no_ground);
  add("--background environment", shows_environment);
  return names;
}

std::string model_format(const std::string& scene) {
  if (!is_file(scene)) return "";
  open(scene);
  return scene_file_format(scene, proto::file_kind(fs::path(scene)));
}

json job_document(const std::string& scene, const JobOptions& options) {
  const auto of_models = options.of_models();
  json job;
  if (const std::string format = model_format(scene); !format.empty()) {
    job = model_job(scene, format, options);
  } else {
    json document = document_of(scene);
    if (!of_models.empty())
      throw Failure(Failure::Kind::usage, of_models.front() + " is for files of models; a document says it itself");
    job = document.contains("scene") ? std::move(document) : json{{"scene", std::move(document)}};
  }

  if (options.name) {
    job["name"] = *options.name;
  } else if (!job.contains("name") && scene != kStandardInput) {
    job["name"] = fs::path(scene).filename().string();
  }
  if (options.priority) job["priority"] = *options.priority;
  if (options.webhook) job["webhook"] = *options.webhook;
  if (options.size) job["image"] = {{"width", options.size->width}, {"height", options.size->height}};
  if (json* settings = section(job, "settings")) apply_settings(options, *settings);
  return job;
}

std::vector<fs::path> named_files(const std::string& scene, const JobOptions& options) {
  std::vector<fs::path> named{scene};
  if (options.environment) named.push_back(fs::absolute(*options.environment));
  return named;
}

fs::path folder_of(const std::string& scene) {
  return scene == kStandardInput ? fs::path() : fs::path(scene).parent_path();
}

}  // namespace tessera::client
