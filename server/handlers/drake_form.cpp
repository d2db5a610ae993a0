#include "server/handlers/drake_form.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "core/math/rounding.h"
#include "proto/wire/printable.h"
#include "server/http/http_syntax.h"
#include "server/http/multipart.h"

namespace tessera::server {
using proto::FieldError;
using proto::Problem;
using proto::ProblemCode;
using proto::Result;

namespace {

constexpr std::uint32_t kColorSamples = 16;
constexpr float kLargest = 1e18F;  ///< As coordinates may be.

constexpr std::string_view kFields[] = {"scene",    "scene_sha256", "image_type", "width", "height", "near",
                                        "far",      "focal_x",      "focal_y",    "fov_x", "fov_y",  "center_x",
                                        "center_y", "min_depth",    "max_depth",  "submit"};

class FormReader {
 public:
  explicit FormReader(const Request& request) : request_(request) {}

  Result<DrakeForm> read(const std::vector<FormPart>& parts) {
    collect(parts);
    form_.scene = field("scene").value_or("");
    if (form_.scene.empty() && fields_.contains("scene")) refuse("scene", "It is empty; send a glTF file.");
    read_hash();
    read_type();
    form_.width = whole("width", field("width"));
    form_.height = whole("height", field("height"));
    read_clipping();
    read_intrinsics();
    read_sensor();
    read_query();
    if (errors_.empty()) return form_;
    return Problem{ProblemCode::malformed_request, "The form can't be rendered; `errors` says why.", errors_};
  }

 private:
  void refuse(std::string_view name, std::string why) {
    if (errors_.size() < proto::kMaxFieldErrors) errors_.push_back({std::string(name), std::move(why)});
  }

  void collect(const std::vector<FormPart>& parts) {
    for (const FormPart& part : parts) {
      if (std::ranges::find(kFields, part.name) == std::end(kFields))
        refuse(proto::printable(part.name), "There is no such field.");
      else if (!fields_.emplace(part.name, part.content).second)
        refuse(part.name, "It is given twice; give it once.");
    }
  }

  std::optional<std::string_view> field(std::string_view name) {
    const auto found = fields_.find(name);
    if (found != fields_.end()) return found->second;
    refuse(name, "It is missing.");
    return std::nullopt;
  }

  void read_hash() {
    const auto text = field("scene_sha256");
    if (!text) return;
    form_.scene_sha256 = "sha256:";
    for (const char c : trimmed(*text))
      form_.scene_sha256 += 'A' <= c && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c;
    if (!proto::is_content_hash(form_.scene_sha256))
      refuse("scene_sha256", "Give the SHA-256 of \"scene\" as 64 hexadecimal digits.");
  }

  void read_type() {
    const auto text = field("image_type");
    if (!text || *text == "color") return;
    if (*text == "depth")
      form_.image_type = DrakeImage::depth;
    else if (*text == "label")
      form_.image_type = DrakeImage::label;
    else
      refuse("image_type", "Give color, depth or label.");
  }

  std::uint32_t whole(std::string_view name, std::optional<std::string_view> text) {
    if (!text) return 0;
    const std::string_view digits = trimmed(*text);
    std::uint32_t value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || end != digits.data() + digits.size() || value == 0)
      refuse(name, "Give a whole number that is at least 1.");
    return value;
  }

  /// Nothing, with an error, for what is missing, or no number.
  std::optional<float> number(std::string_view name) {
    const auto text = field(name);
    if (!text) return std::nullopt;
    const std::string_view digits = trimmed(*text);
    double value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc() && end == digits.data() + digits.size() && !std::isnan(value))
      return std::abs(value) <= std::numeric_limits<float>::max()
                 ? static_cast<float>(value)
                 : std::copysign(kInfinity, static_cast<float>(value > 0 ? 1 : -1));
    refuse(name, "Give a number.");
    return std::nullopt;
  }

  float number_between(std::string_view name, float above, float below, const char* what) {
    const auto value = number(name);
    if (value && !(*value > above && *value < below)) refuse(name, std::string("Give ") + what + ".");
    return value.value_or(0);
  }

  void read_clipping() {
    const auto near = number("near"), far = number("far");
    if (!near || !far) return;
    form_.clipping = {*near, *far};
    if (!(*near >= 0 && *near < *far)) refuse("near", "Give metres, at least 0 and less than \"far\".");
  }

  void read_intrinsics() {
    constexpr float kHalfTurn = std::numbers::pi_v<float>;
    number_between("fov_x", 0, kHalfTurn, "an angle in radians, more than 0 and less than pi");
    number_between("fov_y", 0, kHalfTurn, "an angle in radians, more than 0 and less than pi");
    form_.intrinsics.fx = number_between("focal_x", 0, kLargest, "a length in pixels that is more than 0");
    form_.intrinsics.fy = number_between("focal_y", 0, kLargest, "a length in pixels that is more than 0");
    // Drake counts from the middle of the first pixel, and here it is from its corner.
    form_.intrinsics.cx = number_between("center_x", -kLargest, kLargest, "a place in pixels") + 0.5F;
    form_.intrinsics.cy = number_between("center_y", -kLargest, kLargest, "a place in pixels") + 0.5F;
  }

  void read_sensor() {
    if (form_.image_type != DrakeImage::depth && !fields_.contains("min_depth") && !fields_.contains("max_depth"))
      return;
    const auto least = number("min_depth"), greatest = number("max_depth");
    if (!least || !greatest) return;
    form_.sensor = {*least, *greatest};
    if (!(*least >= 0 && *least < *greatest))
      refuse("min_depth", "Give metres, at least 0 and less than \"max_depth\".");
  }

  void read_query() {
    const bool is_depth = form_.image_type == DrakeImage::depth, is_color = form_.image_type == DrakeImage::color;
    const auto samples = request_.query("samples"), depth = request_.query("depth"), format = request_.query("format");
    form_.samples = is_color ? kColorSamples : 1;
    if (samples && !is_color)
      refuse("?samples", "Only colour has this; other images are of one sample, at the middle of each pixel.");
    else if (samples)
      form_.samples = whole("?samples", samples);
    if (depth && !is_depth)
      refuse("?depth", "Only depth has this.");
    else if (depth && *depth != "float" && *depth != "uint16")
      refuse("?depth", "Give float (metres) or uint16 (millimetres).");
    form_.sensor.is_in_millimetres = depth == "uint16";
    const bool is_float = is_depth && !form_.sensor.is_in_millimetres;
    const std::string_view name = format.value_or(is_float ? "tiff" : "png");
    form_.format = name == "tiff" ? ImageFormat::tiff : ImageFormat::png;
    const bool can_be = is_float ? name == "tiff" : name == "png" || (is_depth && name == "tiff");
    if (!can_be)
      refuse("?format", is_float   ? "Depth comes as tiff, and with depth=uint16 as png or tiff."
                        : is_depth ? "Give png or tiff."
                                   : "This comes as png.");
  }

  const Request& request_;
  std::map<std::string_view, std::string_view> fields_;
  DrakeForm form_;
  std::vector<FieldError> errors_;
};

}  // namespace

std::vector<std::string_view> drake_query_names() { return {"samples", "depth", "format"}; }

Result<DrakeForm> read_drake_form(const Request& request, std::string_view body) {
  const auto parts = parse_form(request.header("content-type").value_or(""), body);
  if (!parts) return parts.problem();
  return FormReader(request).read(*parts);
}

}  // namespace tessera::server
