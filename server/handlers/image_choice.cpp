#include "server/handlers/image_choice.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/film/aov_table.h"
#include "core/io/display_curve.h"
#include "server/http/media_type.h"
#include "server/http/query_errors.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;
using proto::Result;

std::span<const FormatEntry> format_table() {
  static constexpr FormatEntry table[] = {
      {ImageFormat::png, "png", "image/png"},    {ImageFormat::jpeg, "jpeg", "image/jpeg"},
      {ImageFormat::exr, "exr", "image/x-exr"},  {ImageFormat::hdr, "hdr", "image/vnd.radiance"},
      {ImageFormat::tiff, "tiff", "image/tiff"},
  };
  return table;
}

std::span<const PlaneEntry> plane_table() {
  static const std::vector<PlaneEntry> table = [] {
    std::vector<PlaneEntry> rows{{kColorPlane, ""}};
    for (const AovEntry& row : aov_table()) rows.push_back({Plane{row.aov}, row.name});
    rows.push_back({kAllPlanes, "all"});
    return rows;
  }();
  return table;
}

std::span<const proto::Choice<ToneMap>> tone_map_names() {
  static constexpr proto::Choice<ToneMap> table[] = {
      {"none", ToneMap::none}, {"khronos_pbr_neutral", ToneMap::khronos_pbr_neutral}, {"aces", ToneMap::aces}};
  return table;
}

namespace {

template <typename Entry>
std::string names_of(std::span<const Entry> table) {
  std::string text;
  for (const Entry& entry : table)
    if (!entry.name.empty()) text += (text.empty() ? "" : ", ") + std::string(entry.name);
  return text;
}

/// Nothing, with an error, when the value means nothing.
std::optional<PlaneEntry> read_plane(const Request& request, QueryErrors& errors) {
  const auto asked = request.query("aov");
  if (!asked) return plane_table().front();
  const auto entry = std::ranges::find(plane_table(), *asked, &PlaneEntry::name);
  if (entry != plane_table().end() && !entry->name.empty()) return *entry;
  errors.add("aov", "There is no such AOV; known: " + names_of(plane_table()) + ".");
  return std::nullopt;
}

void check_format(const Request& request, QueryErrors& errors) {
  const auto asked = request.query("format");
  if (asked && std::ranges::find(format_table(), *asked, &FormatEntry::name) == format_table().end())
    errors.add("format", "There is no such format; known: " + names_of(format_table()) + ".");
}

bool read_partial(const Request& request, QueryErrors& errors) {
  const std::string_view value = request.query("partial").value_or("0");
  if (value != "0" && value != "1") errors.add("partial", "Give 1 or 0.");
  return value == "1";
}

constexpr int kDefaultQuality = 95;
/// From here on colours are as sharp as brightness, unless asked otherwise: who wants so good a picture wants fine
/// lines in it to keep their colours.
constexpr int kSharpQuality = 90;

/// As asked for, or as it fits.
JpegOptions read_jpeg(const Request& request, QueryErrors& errors) {
  JpegOptions jpeg{kDefaultQuality, Subsampling::s444};
  if (const auto text = request.query("quality")) {
    const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), jpeg.quality);
    if (error != std::errc() || end != text->data() + text->size() || jpeg.quality < 1 || jpeg.quality > 100)
      errors.add("quality", "Give a whole number from 1 to 100.");
  }
  const auto asked = request.query("subsampling");
  if (!asked) {
    if (jpeg.quality < kSharpQuality) jpeg.subsampling = Subsampling::s420;
  } else if (*asked == "4:2:2") {
    jpeg.subsampling = Subsampling::s422;
  } else if (*asked == "4:2:0") {
    jpeg.subsampling = Subsampling::s420;
  } else if (*asked != "4:4:4") {
    errors.add("subsampling", "Give one of 4:4:4, 4:2:2 and 4:2:0.");
  }
  return jpeg;
}

/// The number that a text is; nothing when it is none.
std::optional<float> number(std::string_view text) {
  float value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

Look read_look(const Request& request, ToneMap tone_map, QueryErrors& errors) {
  Look look{0, tone_map};
  if (const auto text = request.query("exposure")) {
    const auto stops = number(*text);
    if (stops && std::abs(*stops) <= kMostStops)
      look.exposure = *stops;
    else
      errors.add("exposure", "Give a number of stops from -64 to 64.");
  }
  if (const auto asked = request.query("tone_map")) {
    const auto entry = std::ranges::find(tone_map_names(), *asked, &proto::Choice<ToneMap>::name);
    if (entry != tone_map_names().end())
      look.tone_map = entry->value;
    else
      errors.add("tone_map", "Give one of " + names_of(tone_map_names()) + ".");
  }
  return look;
}

/// What shows through; nothing where nothing has to, or where there is an error.
std::optional<Rgb> read_background(const Request& request, const Settings& settings, QueryErrors& errors) {
  const auto asked = request.query("background");
  if (!asked) return std::nullopt;
  const auto color = read_hex_color(*asked);
  if (!color && *asked != "transparent" && *asked != "environment")
    errors.add("background",
               "Give a colour as six hexadecimal digits (ffffff), white, black, transparent or environment.");
  else if (settings.transparent == (*asked == "environment"))
    errors.add("background", settings.transparent ? "What is behind isn't in this image, which is transparent."
                                                  : "Nothing of this image is transparent; submit the job with "
                                                    "/settings/transparent.");
  return color;
}

Precision read_precision(const Request& request, QueryErrors& errors) {
  const std::string_view asked = request.query("precision").value_or("float");
  if (asked != "float" && asked != "half") errors.add("precision", "Give float or half.");
  return asked == "half" ? Precision::half : Precision::single;
}

bool can_hold(ImageFormat format, Plane plane, const Settings& settings) {
  return tessera::can_hold(format, plane, settings.width, settings.height, settings.aovs);
}

/// Precondition: `format`, where it is asked for, is known.
Result<FormatEntry> choose_format(const Request& request, const PlaneEntry& plane, const Settings& settings) {
  const auto asked = request.query("format");
  const std::string_view accept = request.header("accept").value_or("*/*");
  std::optional<FormatEntry> best;
  double best_weight = 0;
  for (const FormatEntry& entry : format_table()) {
    if (!can_hold(entry.format, plane.plane, settings)) continue;
    const double weight = asked ? (entry.name == *asked ? 1 : 0) : acceptance(accept, entry.media_type);
    if (weight > best_weight) {
      best = entry;
      best_weight = weight;
    }
  }
  if (best) return *best;
  return Problem{ProblemCode::not_acceptable,
                 "This image, of " + std::to_string(settings.width) + " × " + std::to_string(settings.height) +
                     " pixels, comes as " + able_formats(plane.plane, settings) + ".",
                 {}};
}

/// What only some formats have, or only the colour.
void check_parameters(const Request& request, Plane plane, const FormatEntry& format, QueryErrors& errors) {
  const std::string comes_as = ", and the image comes as " + std::string(format.name) + "; ";
  const auto refuse = [&](std::initializer_list<const char*> names, const std::string& why) {
    for (const char* name : names)
      if (request.query(name)) errors.add(name, why);
  };
  if (format.format != ImageFormat::jpeg)
    refuse({"quality", "subsampling"}, "Only JPEG has this" + comes_as + "add format=jpeg.");
  if (format.format != ImageFormat::exr) refuse({"precision"}, "Only EXR has this" + comes_as + "add format=exr.");
  const std::string_view background = request.query("background").value_or("");
  if (plane != kColorPlane)
    refuse({"exposure", "tone_map", "background"}, "Only the colour has this; leave it or aov out.");
  else if (limits_of(format.format).values != PixelValues::display) {
    refuse({"exposure", "tone_map"}, "Only PNG and JPEG have this" + comes_as + "add format=png.");
    if (background != "transparent" && background != "environment")
      refuse({"background"}, "Only PNG and JPEG have a colour behind" + comes_as + "add format=png.");
  } else if (format.format == ImageFormat::jpeg && background == "transparent") {
    refuse({"background"}, "A JPEG isn't transparent; give a colour, or add format=png.");
  }
}

}  // namespace

std::optional<Rgb> read_hex_color(std::string_view text) {
  if (text == "white") return Rgb{1, 1, 1};
  if (text == "black") return Rgb{0, 0, 0};
  if (text.starts_with('#')) text.remove_prefix(1);
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc() || end != text.data() + text.size() || text.size() != 6) return std::nullopt;
  const auto light = [&](int shift) { return display_light(static_cast<std::uint8_t>(value >> shift)); };
  return Rgb{light(16), light(8), light(0)};
}

std::string able_formats(Plane plane, const Settings& settings) {
  std::string able;
  for (const FormatEntry& entry : format_table())
    if (can_hold(entry.format, plane, settings))
      able += (able.empty() ? "" : ", ") + std::string(entry.name) + " (" + std::string(entry.media_type) + ")";
  return able;
}

Result<ImageChoice> choose_image(const Request& request, const Settings& settings, const ImageDefaults& defaults) {
  QueryErrors errors;
  const bool partial = read_partial(request, errors);
  const auto plane = read_plane(request, errors);
  check_format(request, errors);
  Encoding encoding;
  encoding.jpeg = read_jpeg(request, errors);
  encoding.look = read_look(request, defaults.tone_map, errors);
  encoding.background = read_background(request, settings, errors);
  encoding.precision = read_precision(request, errors);
  encoding.transparent = settings.transparent;
  if (!errors.empty()) return std::move(errors).as_problem();
  if (plane->plane.aov && !settings.aovs.contains(*plane->plane.aov))
    return Problem{
        ProblemCode::not_found,
        "The job didn't record " + std::string(plane->name) + "; ask for it in /settings/aovs when you submit it.",
        {}};
  const auto format = choose_format(request, *plane, settings);
  if (!format) return format.problem();
  check_parameters(request, plane->plane, *format, errors);
  if (!errors.empty()) return std::move(errors).as_problem();
  encoding.format = format->format;
  if (plane->plane != kColorPlane || limits_of(format->format).values != PixelValues::display)
    encoding.look = {};
  else if (!request.query("background") && settings.transparent)
    encoding.background = defaults.background;
  return ImageChoice{plane->plane, *format, encoding, partial};
}

}  // namespace tessera::server
