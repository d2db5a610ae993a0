#include "server/handlers/job_draft.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include <nlohmann/json.hpp>

#include "core/math/portable.h"
#include "proto/names.h"
#include "server/handlers/json_members.h"
#include "server/http/query_errors.h"

namespace tessera::server {
using nlohmann::json;
using proto::FieldError;
using proto::FileFormat;
using proto::Problem;
using proto::Result;

namespace {

constexpr std::uint32_t kDefaultSide = 512;
constexpr double kDefaultError = 0.02;
constexpr std::uint32_t kDefaultSamples = 256;
/// Three quarters from the front, which is +z, and a little from above.
constexpr double kAzimuth = 30, kElevation = 20;
/// As narrow as products are photographed.
constexpr double kFieldOfView = 30;

/// A parameter that says something of the job, and where the document has that.
struct Place {
  std::string_view parameter;
  std::string_view pointer;
};
constexpr Place kInScene[] = {
    {"up", "/objects/0/transform"},       {"smooth", "/objects/0/smooth"}, {"variant", "/objects/0/variant"},
    {"camera", "/objects/0/file_camera"}, {"environment", "/lights/0"},    {"ground", "/ground"},
};
constexpr Place kInJob[] = {
    {"width", "/image/width"},
    {"height", "/image/height"},
    {"width", "/image"},
    {"samples", "/settings/until/samples"},
    {"error", "/settings/until/error"},
    {"seconds", "/settings/until/seconds"},
    {"samples", "/settings/samples"},
    {"fov", "/camera/fov"},
    {"elevation", "/camera"},
    {"background", "/settings/transparent"},
    {"aov", "/settings/aovs"},
};

bool is_a_scene(const Asset& asset) { return asset.kind != AssetKind::model || asset.format == FileFormat::nff; }

json studio_light() { return {{"type", "environment"}, {"preset", "studio"}}; }

/// Collects the documents' parts.
class Drafter {
 public:
  Drafter(const Request& request, const Asset& asset) : request_(request), asset_(asset) {}

  Result<JobDraft> draft() {
    read_size();
    read_end();
    read_view();
    read_shown();
    if (asset_.kind == AssetKind::model)
      draft_model();
    else
      draft_document();
    if (!errors_.empty()) return std::move(errors_).as_problem();
    draft_.is_timed = request_.query("seconds").has_value() || is_timed_;
    const std::string fields = job_.dump();
    if (asset_.kind == AssetKind::job_document) {
      draft_.key = proto::content_hash("job " + asset_.hash + fields);
      draft_.job = with_members(asset_.document);
    } else {
      draft_.key = proto::content_hash(draft_.scene_key + fields);
      draft_.job = fields;
    }
    return std::move(draft_);
  }

 private:
  std::optional<json> number(std::string_view name, double least, double greatest) {
    const auto text = request_.query(name);
    if (!text) return std::nullopt;
    json value = json::parse(*text, nullptr, false);
    if (value.is_number() && value >= least && value <= greatest) return value;
    errors_.add(name, "Give a number" + range(least, greatest) + ".");
    return std::nullopt;
  }

  static std::string range(double least, double greatest) {
    if (std::isinf(greatest)) return std::isinf(least) ? "" : " that is at least " + json(least).dump();
    return " from " + json(least).dump() + " to " + json(greatest).dump();
  }

  std::optional<json> whole(std::string_view name) {
    const auto text = request_.query(name);
    if (!text) return std::nullopt;
    json value = json::parse(*text, nullptr, false);
    if (value.is_number_unsigned() && value > 0U && value <= 0xFFFFFFFFU) return value;
    errors_.add(name, "Give a whole number that is at least 1.");
    return std::nullopt;
  }

  bool is_asked(std::initializer_list<std::string_view> names) const {
    return std::ranges::any_of(names, [&](std::string_view name) { return request_.query(name).has_value(); });
  }

  void refuse(std::initializer_list<std::string_view> names, const std::string& why) {
    for (const std::string_view name : names)
      if (request_.query(name)) errors_.add(name, why);
  }

  /// One side alone is both.
  void read_size() {
    auto width = whole("width"), height = whole("height");
    if (!width && !height && is_a_scene(asset_)) return;
    const json side = width.value_or(height.value_or(kDefaultSide));
    job_["image"] = {{"width", width.value_or(side)}, {"height", height.value_or(side)}};
    draft_.expected.width = job_["image"]["width"];
    draft_.expected.height = job_["image"]["height"];
  }

  void read_end() {
    constexpr double kNoLimit = std::numeric_limits<double>::infinity();
    const auto samples = whole("samples");
    const auto error = number("error", 0, kNoLimit), seconds = number("seconds", 0, kNoLimit);
    json until = json::object();
    if (samples) until["samples"] = *samples;
    if (error) until["error"] = *error;
    if (seconds) until["seconds"] = *seconds;
    if (!is_asked({"samples", "error", "seconds"})) until = {{"error", kDefaultError}, {"samples", kDefaultSamples}};
    job_["settings"]["until"] = until;
  }

  /// The camera that the server places, but for scenes with one of their own.
  void read_view() {
    const auto azimuth = number("azimuth", -360, 360), elevation = number("elevation", -90, 90),
               fov = number("fov", 0, 180);
    const auto named = request_.query("camera");
    const bool is_asked_for = is_asked({"azimuth", "elevation", "fov"});
    if (named) {
      refuse({"azimuth", "elevation", "fov"}, "The file's camera says this; leave it or camera out.");
      return;
    }
    if (is_a_scene(asset_) && !is_asked_for) return;
    const double around = degrees(azimuth.value_or(kAzimuth)), above = degrees(elevation.value_or(kElevation));
    const double x = portable_sin(around), z = portable_cos(around), flat = portable_cos(above);
    json camera{{"type", "perspective"},
                {"direction", {-x * flat, -portable_sin(above), -z * flat}},
                {"fov", fov.value_or(kFieldOfView)}};
    // From straight above, what is at the back is up.
    const double height = elevation.value_or(kElevation);
    if (std::abs(height) == 90) {
      const double way = height > 0 ? -1 : 1;
      camera["direction"] = {0, way, 0};
      camera["up"] = {way * x, 0, way * z};
    }
    job_["camera"] = std::move(camera);
  }

  static double degrees(double value) { return value / 180 * std::numbers::pi; }

  /// What lies behind all, and beside the colour.
  void read_shown() {
    const auto background = request_.query("background");
    const bool is_transparent = background ? *background != "environment" : !is_a_scene(asset_);
    if (is_transparent || background) job_["settings"]["transparent"] = is_transparent;
    draft_.expected.transparent = is_transparent;
    if (is_transparent) draft_.expected.aovs.insert(Aov::alpha);
    draft_.image.tone_map = ToneMap::khronos_pbr_neutral;
    if (is_transparent) draft_.image.background = Rgb{1, 1, 1};
    const auto aov = request_.query("aov");
    const auto* const known = std::ranges::find(proto::aov_names(), aov.value_or(""), &proto::Choice<Aov>::name).base();
    if (!aov || known == proto::aov_names().data() + proto::aov_names().size()) return;  // `choose_image` refuses it.
    job_["settings"]["aovs"] = {*aov};
    draft_.expected.aovs.insert(known->value);
  }

  void draft_model() {
    json object{
        {"type", "file"}, {"blob", asset_.hash}, {"format", name_of(proto::file_format_names(), asset_.format)}};
    if (!asset_.companions.empty()) object["companions"] = asset_.companions;
    if (const auto name = request_.query("camera")) {
      const json index = json::parse(*name, nullptr, false);
      object["file_camera"] = index.is_number_unsigned() ? index : json(*name);
    }
    if (const auto name = request_.query("variant")) object["variant"] = *name;
    if (const auto angle = number("smooth", 0, 180)) object["smooth"] = *angle;
    const std::string_view up = request_.query("up").value_or("y");
    if (up == "z")
      object["transform"] = {1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0};
    else if (up != "y")
      errors_.add("up", "Give y or z.");
    const std::string_view ground = request_.query("ground").value_or("shadow");
    if (ground != "shadow" && ground != "none") errors_.add("ground", "Give shadow or none.");
    json scene{{"objects", {object}}};
    if (request_.query("environment"))
      scene["lights"] = {environment()};
    else if (!is_a_scene(asset_))
      scene["lights"] = {{{"type", "environment"}, {"preset", "studio"}, {"only_without_lights", true}}};
    if (ground == "shadow" && !is_a_scene(asset_)) scene["ground"] = "shadow";
    draft_.scene = scene.dump();
    draft_.scene_key = proto::content_hash("scene " + draft_.scene);
  }

  json environment() {
    const std::string_view asked = *request_.query("environment");
    if (asked == "studio") return studio_light();
    if (proto::is_content_hash(asked)) return {{"type", "environment"}, {"blob", asked}};
    json radiance;
    if (const auto color = read_hex_color(asked)) {
      radiance = {color->r, color->g, color->b};
    } else {
      radiance = json::parse('[' + std::string(asked) + ']', nullptr, false);
      if (radiance.is_array() && radiance.size() == 1) radiance = {radiance[0], radiance[0], radiance[0]};
    }
    const auto is_number = [](const json& value) { return value.is_number() && value >= 0; };
    if (!radiance.is_array() || radiance.size() != 3 || !std::ranges::all_of(radiance, is_number))
      errors_.add("environment",
                  "Give studio, the hash of an image that was uploaded, a colour as six hexadecimal digits, or its "
                  "radiance as one number or three (0.5, or 1,0.9,0.8).");
    return {{"type", "environment"}, {"radiance", radiance}};
  }

  /// A document is taken as it is; the query says what it doesn't.
  void draft_document() {
    constexpr const char* kWhy = "This is for files of models; a document says it itself.";
    refuse({"environment", "ground", "up", "smooth", "variant", "camera"}, kWhy);
    draft_.names_paths = asset_.document.find("\"path\"") != std::string_view::npos ||
                         asset_.document.find("\\u") != std::string_view::npos;
    if (asset_.kind == AssetKind::job_document) return fit_to_job();
    if (has_member(asset_.document, "camera")) refuse_stated({"azimuth", "elevation", "fov"});
    draft_.scene = asset_.document;
    draft_.scene_key = proto::content_hash("scene document " + asset_.hash);
  }

  void refuse_stated(std::initializer_list<std::string_view> names) {
    refuse(names, "The document says this already; leave it out there or here.");
  }

  void fit_to_job() {
    for (const JsonMember& member : json_members(asset_.document)) {
      if (member.name == "camera") refuse_stated({"azimuth", "elevation", "fov"});
      if (member.name == "image") refuse_stated({"width", "height"});
      if (member.name != "settings") continue;
      settings_ = json::parse(member.value, nullptr, false);
      if (!settings_.is_object()) continue;  // What parses it says so.
      if (settings_.contains("samples") || settings_.contains("until")) {
        refuse_stated({"samples", "error", "seconds"});
        job_["settings"].erase("until");
        const auto until = settings_.find("until");
        is_timed_ = until != settings_.end() && until->is_object() && until->contains("seconds");
      }
      if (settings_.contains("transparent")) refuse_stated({"background"});
      draft_.expected.transparent = draft_.expected.transparent || settings_.value("transparent", json()) == true;
      if (draft_.expected.transparent) draft_.image.background = Rgb{1, 1, 1};
      if (settings_.contains("aovs")) job_["settings"].erase("aovs");
    }
    if (settings_.is_object()) settings_.update(job_["settings"]);
  }

  /// The job document with what the query adds.
  std::string with_members(std::string_view document) const {
    std::string text = "{";
    const auto add = [&](std::string_view name, std::string_view value) {
      text += (text.size() > 1 ? "," : "") + json(name).dump() + ':';
      text += value;
    };
    bool has_settings = false;
    for (const JsonMember& member : json_members(document)) {
      has_settings |= member.name == "settings";
      add(member.name, member.name == "settings" && settings_.is_object() ? settings_.dump() : member.value);
    }
    for (const auto& [name, value] : job_.items())
      if (name != "settings" || !has_settings) add(name, value.dump());
    return text + '}';
  }

  const Request& request_;
  const Asset& asset_;
  QueryErrors errors_;
  JobDraft draft_;
  json job_ = json::object();
  json settings_;  ///< Of a job document, with what the query adds.
  bool is_timed_ = false;
};

std::optional<std::string> parameter_at(std::span<const Place> places, std::string_view pointer) {
  for (const Place& place : places)
    if (pointer.starts_with(place.pointer) &&
        (pointer.size() == place.pointer.size() || pointer[place.pointer.size()] == '/'))
      return '?' + std::string(place.parameter);
  return std::nullopt;
}

void replace_all(std::string& text, std::string_view what, std::string_view with) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size()))
    text.replace(at, what.size(), with);
}

}  // namespace

std::vector<std::string_view> render_query_names() {
  return {"width",  "height",      "samples",     "error",    "seconds",  "camera",   "azimuth", "elevation",
          "fov",    "environment", "background",  "ground",   "up",       "smooth",   "variant", "aov",
          "format", "quality",     "subsampling", "exposure", "tone_map", "precision"};
}

Result<JobDraft> draft_job(const Request& request, const Asset& asset) { return Drafter(request, asset).draft(); }

Problem scene_problem(Problem problem, const Asset& asset) {
  if (asset.kind != AssetKind::model) return problem;
  if (!problem.errors.empty()) problem.detail = "The file can't be rendered so; `errors` says why.";
  for (FieldError& error : problem.errors) {
    const auto parameter = parameter_at(kInScene, error.pointer);
    if (parameter || error.pointer.starts_with('/')) error.pointer = parameter.value_or(asset.name);
    replace_all(error.pointer, asset.hash, asset.name);
    replace_all(error.detail, asset.hash, asset.name);
  }
  return problem;
}

Problem job_problem(Problem problem, const Asset& asset) {
  if (asset.kind == AssetKind::job_document) return problem;
  if (!problem.errors.empty()) problem.detail = "The file can't be rendered so; `errors` says why.";
  for (FieldError& error : problem.errors) error.pointer = parameter_at(kInJob, error.pointer).value_or(asset.name);
  return problem;
}

}  // namespace tessera::server
