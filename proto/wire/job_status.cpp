#include "proto/wire/job_status.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <type_traits>

#include <nlohmann/json.hpp>

namespace tessera::proto {
namespace {

// In the order of JobState.
constexpr std::array<std::string_view, 6> kNames{"queued", "preparing", "rendering", "completed", "failed", "canceled"};

// In the order of ImageState.
constexpr std::array<std::string_view, 4> kImageNames{"none", "partial", "complete", "gone"};

// In the order of WebhookState.
constexpr std::array<std::string_view, 3> kWebhookNames{"pending", "delivered", "failed"};

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

bool read(const nlohmann::json& json, const char* name, WebhookStatus& out) {
  const auto field = json.find(name);
  std::string state;
  if (field == json.end() || !field->is_object() || !read(*field, "state", state) || !webhook_state(state))
    return false;
  out.state = *webhook_state(state);
  return read(*field, "host", out.host) && read(*field, "attempts", out.attempts) && read(*field, "error", out.error);
}

/// Whether the field is right, or absent.
template <typename T>
bool read_optional(const nlohmann::json& json, const char* name, std::optional<T>& out) {
  if (!json.contains(name)) return true;
  return read(json, name, out.emplace());
}

constexpr std::size_t kUsualLength = 768;

/// An object's members as JSON text, one after the other: statuses are polled more than anything else is asked for, and
/// most of an answer's time would go into a document made of them first.
class Members {
 public:
  explicit Members(std::string& text) : text_(text) { text_ += '{'; }
  void end() { text_ += '}'; }

  template <typename T>
  void add(std::string_view name, const T& value) {
    if (text_.back() != '{') text_ += ',';
    text_ += '"';
    text_ += name;
    text_ += "\":";
    write(value);
  }

 private:
  void write(std::string_view value) {
    const auto is_plain = [](char c) { return c >= ' ' && c <= '~' && c != '"' && c != '\\'; };
    if (std::ranges::all_of(value, is_plain))
      (text_ += '"').append(value) += '"';
    else
      text_ += nlohmann::json(value).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }
  void write(const std::string& value) { write(std::string_view(value)); }
  void write(std::uint32_t value) { write_number(value); }
  void write(std::uint64_t value) { write_number(value); }
  /// With a point or an exponent, so that who reads it knows its type; null where JSON has no number for it.
  void write(double value) {
    if (!std::isfinite(value)) {
      text_ += "null";
      return;
    }
    const std::size_t begin = text_.size();
    write_number(value);
    if (text_.find_first_of(".e", begin) == std::string::npos) text_ += ".0";
  }
  void write(const Range& range) {
    text_ += '[';
    write(range.low);
    text_ += ',';
    write(range.high);
    text_ += ']';
  }
  void write(const SamplesPerPixel& samples) {
    Members members(text_);
    members.add("min", samples.least);
    members.add("mean", samples.mean);
    members.add("max", samples.most);
    members.end();
  }
  void write(const Achieved& achieved) {
    Members members(text_);
    members.add("error", achieved.error);
    members.add("interval", achieved.interval);
    members.end();
  }
  void write(const WebhookStatus& webhook) {
    Members members(text_);
    members.add("host", webhook.host);
    members.add("state", name(webhook.state));
    members.add("attempts", webhook.attempts);
    members.add("error", webhook.error);
    members.end();
  }
  void write_number(auto value) {
    char digits[32];  // More than the shortest form of any double takes.
    text_.append(digits, std::to_chars(std::begin(digits), std::end(digits), value).ptr);
  }

  std::string& text_;
};

}  // namespace

std::string_view name(JobState state) { return kNames.at(static_cast<std::size_t>(state)); }

std::string_view name(ImageState state) { return kImageNames.at(static_cast<std::size_t>(state)); }

std::string_view name(WebhookState state) { return kWebhookNames.at(static_cast<std::size_t>(state)); }

std::optional<WebhookState> webhook_state(std::string_view name) {
  const auto found = std::ranges::find(kWebhookNames, name);
  if (found == kWebhookNames.end()) return std::nullopt;
  return static_cast<WebhookState>(found - kWebhookNames.begin());
}

std::optional<JobState> job_state(std::string_view name) {
  const auto found = std::ranges::find(kNames, name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<JobState>(found - kNames.begin());
}

std::string json_text(const JobStatus& s) {
  std::string text;
  text.reserve(kUsualLength);
  Members members(text);
  members.add("id", s.id);
  members.add("name", s.name);
  members.add("priority", s.priority);
  members.add("state", name(s.state));
  members.add("image", name(s.image));
  members.add("scene", s.scene);
  members.add("width", s.width);
  members.add("height", s.height);
  members.add("tiles_done", s.tiles_done);
  members.add("tiles_total", s.tiles_total);
  members.add("samples_done", s.samples_done);
  members.add("samples_total", s.samples_total);
  members.add("progress", s.progress);
  members.add("progress_range", s.progress_range);
  members.add("passes", s.passes);
  members.add("samples_per_pixel", s.samples_per_pixel);
  members.add("elapsed", s.elapsed);
  if (s.eta) members.add("eta", *s.eta);
  if (s.eta_range) members.add("eta_range", *s.eta_range);
  if (s.ended_by) members.add("ended_by", *s.ended_by);
  if (s.achieved) members.add("achieved", *s.achieved);
  members.add("created", s.created);
  members.add("error", s.error);
  members.add("warnings", s.warnings);
  if (s.webhook) members.add("webhook", *s.webhook);
  members.end();
  return text;
}

nlohmann::json to_json(const JobStatus& status) { return nlohmann::json::parse(json_text(status)); }

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
                            read_optional(json, "ended_by", s.ended_by) &&
                            read_optional(json, "achieved", s.achieved) && read_optional(json, "webhook", s.webhook);
  if (!optional_fit) return std::nullopt;
  return s;
}

}  // namespace tessera::proto
