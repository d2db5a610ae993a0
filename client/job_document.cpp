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

/// Lights for a mesh that is seen as the server frames it, from the right and above: one from the other side, so
/// that shapes stand out, and a little from everywhere.
json default_lights() {
  return json::array({{{"type", "directional"}, {"direction", {0.5, -0.9, -0.8}}, {"irradiance", {2.8, 2.8, 2.8}}},
                      {{"type", "ambient"}, {"radiance", {0.15, 0.15, 0.15}}}});
}

json scene_around(const std::string& file, const std::string& format) {
  const json object{{"type", "file"}, {"path", fs::path(file).filename().string()}};
  json scene{{"objects", json::array({object})}};
  if (format != "nff") scene["lights"] = default_lights();
  return scene;
}

/// A file is what its content says. What can be read only once, as a pipe can, is a document.
json document_of(const std::string& scene) {
  constexpr const char* kKnown = "known are JSON documents, OBJ, PLY, STL and NFF";
  using proto::FileKind;
  std::error_code ignored;
  const bool is_file = scene != kStandardInput && fs::is_regular_file(scene, ignored);
  if (is_file) {
    open(scene);
    const FileKind kind = proto::file_kind(fs::path(scene));
    const std::string format = scene_file_format(scene, kind);
    if (!format.empty()) return scene_around(scene, format);
    const bool may_be_json = kind == FileKind::json || fs::path(scene).extension() == ".json";
    if (!may_be_json) refuse_kind(scene, kind, kKnown);
  }
  const std::string text = read_all(scene);
  const FileKind kind = proto::file_kind(text, text.size());
  if (kind != FileKind::json && kind != FileKind::unknown)
    refuse_kind(scene, kind, is_file ? kKnown : "a document is expected where there is no file");
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

json job_document(const std::string& scene, const JobOptions& options) {
  json document = document_of(scene);
  json job = document.contains("scene") ? std::move(document) : json{{"scene", std::move(document)}};

  if (options.name) {
    job["name"] = *options.name;
  } else if (!job.contains("name") && scene != kStandardInput) {
    job["name"] = fs::path(scene).filename().string();
  }
  if (options.size) job["image"] = {{"width", options.size->width}, {"height", options.size->height}};
  if (json* settings = section(job, "settings")) apply_settings(options, *settings);
  return job;
}

fs::path folder_of(const std::string& scene) {
  return scene == kStandardInput ? fs::path() : fs::path(scene).parent_path();
}

}  // namespace tessera::client
