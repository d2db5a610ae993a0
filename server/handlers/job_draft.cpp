#include "server/handlers/job_draft.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include <nlohmann/json.hpp>

#include "proto/names.h"
#include "proto/wire/model_picture.h"
#include "server/handlers/json_members.h"
#include "server/http/query_errors.h"

namespace tessera::server {
using nlohmann::json;
using proto::FieldError;
using proto::FileFormat;
using proto::Problem;
using proto::Result;

namespace {

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

/// Numbers that a parameter takes, as floats, which is what documents keep of them.
struct Bounds {
  float least, greatest;
  bool are_out = false;  ///< Themselves.

  bool hold(double value) const {
    if (!(std::abs(value) <= std::numeric_limits<float>::max())) return false;
    const auto kept = static_cast<float>(value);
    return are_out ? kept > least && kept < greatest : kept >= least && kept <= greatest;
  }
  std::string words() const {
    if (!std::isinf(greatest))
      return are_out ? "greater than " + json(least).dump() + " and less than " + json(greatest).dump()
                     : "from " + json(least).dump() + " to " + json(greatest).dump();
    return "greater than " + json(least).dump();
  }
};
constexpr Bounds kPositive{0, std::numeric_limits<float>::infinity(), true};

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
  std::optional<double> number(std::string_view name, const Bounds& bounds) {
    const auto text = request_.query(name);
    if (!text) return std::nullopt;
    const json value = json::parse(*text, nullptr, false);
    if (value.is_number() && bounds.hold(value)) return value.get<double>();
    errors_.add(name, "Give a number " + bounds.words() + '.');
    return std::nullopt;
  }

  std::optional<std::uint32_t> whole(std::string_view name) {
    const auto text = request_.query(name);
    if (!text) return std::nullopt;
    const json value = json::parse(*text, nullptr, false);
    if (value.is_number_unsigned() && value > 0U && value <= 0xFFFFFFFFU) return value.get<std::uint32_t>();
    errors_.add(name, "Give a whole number from 1 to 4294967295.");
    return std::nullopt;
  }

  void refuse(std::initializer_list<std::string_view> names, const std::string& why) {
    for (const std::string_view name : names)
      if (request_.query(name)) errors_.add(name, why);
  }

  void read_size() {
    const auto width = whole("width"), height = whole("height");
    if (!width && !height && is_a_scene(asset_)) return;
    job_["image"] = proto::picture_size(width, height);
    draft_.expected.width = job_["image"]["width"];
    draft_.expected.height = job_["image"]["height"];
  }

  void read_end() {
    proto::PictureEnd end;
    end.samples = whole("samples");
    end.error = number("error", kPositive);
    end.seconds = number("seconds", kPositive);
    job_["settings"]["until"] = proto::picture_until(end);
  }

  /// The camera that the server places, but for scenes with one of their own.
  void read_view() {
    const proto::ViewAngles angles{.azimuth = number("azimuth", {-360, 360}),
                                   .elevation = number("elevation", {-90, 90}),
                                   .fov = number("fov", {0, 180, true})};
    if (request_.query("camera"))
      refuse({"azimuth", "elevation", "fov"}, "The file's camera says this; leave it or camera out.");
    else if (!is_a_scene(asset_) || angles.is_given())
      job_["camera"] = proto::view_camera(angles);
  }

  /// What lies behind all, and beside the colour.
  void read_shown() {
    const auto background = request_.query("background");
    const bool is_transparent = background ? *background != "environment" : !is_a_scene(asset_);
    if (is_transparent || background) job_["settings"]["transparent"] = is_transparent;
    draft_.expected.transparent = is_transparent;
    if (is_transparent) draft_.expected.aovs.insert(Aov::alpha);
    draft_.image.tone_map =
        std::ranges::find(tone_map_names(), proto::kPictureToneMap, &proto::Choice<ToneMap>::name)->value;
    if (is_transparent) draft_.image.background = read_hex_color(proto::kPictureBackground);
    // One that isn't known `choose_image` refuses.
    const std::string_view asked = request_.query("aov").value_or("");
    for (const auto& [aov_name, aov] : proto::aov_names()) {
      const bool is_cost = aov == Aov::cost_volumes || aov == Aov::cost_primitives;  // counting takes long
      if (asked != aov_name && (asked != "all" || is_cost)) continue;
      job_["settings"]["aovs"].push_back(aov_name);
      draft_.expected.aovs.insert(aov);
    }
  }

  void draft_model() {
    json object{
        {"type", "file"}, {"blob", asset_.hash}, {"format", name_of(proto::file_format_names(), asset_.format)}};
    if (!asset_.companions.empty()) object["companions"] = asset_.companions;
    const auto text_of = [&](std::string_view name) { return std::optional<std::string>(request_.query(name)); };
    proto::ModelLook look{.is_a_scene = is_a_scene(asset_),
                          .camera = text_of("camera"),
                          .variant = text_of("variant"),
                          .smooth = number("smooth", {0, 180}),
                          .environment = environment()};
    const std::string_view up = request_.query("up").value_or("y"),
                           ground = request_.query("ground").value_or("shadow");
    if (up != "y" && up != "z") errors_.add("up", "Give y or z.");
    if (ground != "shadow" && ground != "none") errors_.add("ground", "Give shadow or none.");
    look.has_z_up = up == "z";
    look.has_ground = ground == "shadow";
    const json scene = proto::model_scene(look, std::move(object));
    draft_.scene = scene.dump();
    draft_.scene_key = proto::content_hash("scene " + draft_.scene);
  }

  /// Null where the query says nothing of it.
  json environment() {
    const auto asked = request_.query("environment");
    if (!asked) return nullptr;
    if (const auto color = read_hex_color(*asked))
      return {{"type", "environment"}, {"radiance", {color->r, color->g, color->b}}};
    if (auto light = proto::environment_light(*asked)) return *std::move(light);
    errors_.add("environment",
                "Give studio, the hash of an image that was uploaded, a colour as six hexadecimal digits, or its "
                "radiance as one number or three, each from 0 to 1e18 (0.5, or 1,0.9,0.8).");
    return nullptr;
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
      if (draft_.expected.transparent) draft_.image.background = read_hex_color(proto::kPictureBackground);
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
