#include "proto/wire/job_status.h"

#include <algorithm>
#include <array>
#include <limits>
#include <type_traits>

#include <nlohmann/json.hpp>

namespace tessera::proto {
namespace {

// In the order of JobState.
constexpr std::array<std::string_view, 6> kNames{"queued", "preparing", "rendering", "completed", "failed", "canceled"};

// In the order of ImageState.
constexpr std::array<std::string_view, 4> kImageNames{"none", "partial", "complete", "gone"};

template <typename T>
bool fits(const nlohmann::json& value) {
  if constexpr (std::is_same_v<T, std::string>) return value.is_string();
  if constexpr (std::is_floating_point_v<T>) return value.is_number();
  if constexpr (std::is_unsigned_v<T>)
    return value.is_number_unsigned() && value.get<std::uint64_t>() <= std::numeric_limits<T>::max();
}

template <typename T>
bool read(const nlohmann::json& json, const char* name, T& out) {
  const auto field = json.find(name);
  if (field == json.end() || !fits<T>(*field)) return false;
  out = field->get<T>();
  return true;
}

nlohmann::json range_json(const Range& range) { return {range.low, range.high}; }

bool read(const nlohmann::json& json, const char* name, Range& out) {
  const auto field = json.find(name);
  if (field == json.end() || !field->is_array() || field->size() != 2) return false;
  if (!(*field)[0].is_number() || !(*field)[1].is_number()) return false;
  out = {(*field)[0].get<double>(), (*field)[1].get<double>()};
  return true;
}

bool read(const nlohmann::json& json, const char* name, SamplesPerPixel& out) {
  const auto field = json.find(name);
  return field != json.end() && field->is_object() && read(*field, "min", out.least) &&
         read(*field, "mean", out.mean) && read(*field, "max", out.most);
}

bool read(const nlohmann::json& json, const char* name, Achieved& out) {
  const auto field = json.find(name);
  return field != json.end() && field->is_object() && read(*field, "error", out.error) &&
         read(*field, "interval", out.interval);
}

/// Whether the field is right, or absent.
template <typename T>
bool read_optional(const nlohmann::json& json, const char* name, std::optional<T>& out) {
  if (!json.contains(name)) return true;
  return read(json, name, out.emplace());
}

}  // namespace

std::string_view name(JobState state) { return kNames.at(static_cast<std::size_t>(state)); }

std::string_view name(ImageState state) { return kImageNames.at(static_cast<std::size_t>(state)); }

std::optional<JobState> job_state(std::string_view name) {
  const auto found = std::ranges::find(kNames, name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<JobState>(found - kNames.begin());
}

nlohmann::json to_json(const JobStatus& s) {
  nlohmann::json json{
      {"id", s.id},
      {"name", s.name},
      {"priority", s.priority},
      {"state", name(s.state)},
      {"image", name(s.image)},
      {"scene", s.scene},
      {"width", s.width},
      {"height", s.height},
      {"tiles_done", s.tiles_done},
      {"tiles_total", s.tiles_total},
      {"samples_done", s.samples_done},
      {"samples_total", s.samples_total},
      {"progress", s.progress},
      {"progress_range", range_json(s.progress_range)},
      {"passes", s.passes},
      {"samples_per_pixel",
       {{"min", s.samples_per_pixel.least}, {"mean", s.samples_per_pixel.mean}, {"max", s.samples_per_pixel.most}}},
      {"elapsed", s.elapsed},
      {"created", s.created},
      {"error", s.error},
      {"warnings", s.warnings}};
  if (s.eta) json["eta"] = *s.eta;
  if (s.eta_range) json["eta_range"] = range_json(*s.eta_range);
  if (s.ended_by) json["ended_by"] = *s.ended_by;
  if (s.achieved) json["achieved"] = {{"error", s.achieved->error}, {"interval", range_json(s.achieved->interval)}};
  return json;
}

std::optional<JobStatus> job_status(const nlohmann::json& json) {
  JobStatus s;
  std::string state, image;
  if (!json.is_object() || !read(json, "state", state) || !job_state(state)) return std::nullopt;
  s.state = *job_state(state);
  const bool complete = read(json, "id", s.id) && read(json, "name", s.name) && read(json, "priority", s.priority) &&
                        read(json, "image", image) && read(json, "scene", s.scene) && read(json, "width", s.width) &&
                        read(json, "height", s.height) && read(json, "tiles_done", s.tiles_done) &&
                        read(json, "tiles_total", s.tiles_total) && read(json, "samples_done", s.samples_done) &&
                        read(json, "samples_total", s.samples_total) && read(json, "progress", s.progress) &&
                        read(json, "progress_range", s.progress_range) && read(json, "passes", s.passes) &&
                        read(json, "samples_per_pixel", s.samples_per_pixel) && read(json, "elapsed", s.elapsed) &&
                        read(json, "created", s.created) && read(json, "error", s.error) &&
                        read(json, "warnings", s.warnings);
  const auto known = std::ranges::find(kImageNames, image);
  if (!complete || known == kImageNames.end()) return std::nullopt;
  s.image = static_cast<ImageState>(known - kImageNames.begin());
  const bool optional_fit = read_optional(json, "eta", s.eta) && read_optional(json, "eta_range", s.eta_range) &&
                            read_optional(json, "ended_by", s.ended_by) && read_optional(json, "achieved", s.achieved);
  if (!optional_fit) return std::nullopt;
  return s;
}

}  // namespace tessera::proto
