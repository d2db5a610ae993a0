#include "server/image_choice.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/film/aov_table.h"
#include "server/media_type.h"
#include "server/query_errors.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;
using proto::Result;

std::span<const FormatEntry> format_table() {
  static constexpr FormatEntry table[] = {
      {ImageFormat::png, "png", "image/png"},
      {ImageFormat::jpeg, "jpeg", "image/jpeg"},
      {ImageFormat::exr, "exr", "image/x-exr"},
      {ImageFormat::hdr, "hdr", "image/vnd.radiance"},
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

/// What only JPEG has.
void check_only_jpeg(const Request& request, const FormatEntry& format, QueryErrors& errors) {
  if (format.format == ImageFormat::jpeg) return;
  for (const char* name : {"quality", "subsampling"})
    if (request.query(name))
      errors.add(name, "Only JPEG has this, and the image comes as " + std::string(format.name) + "; add format=jpeg.");
}

}  // namespace

std::string able_formats(Plane plane, const Settings& settings) {
  std::string able;
  for (const FormatEntry& entry : format_table())
    if (can_hold(entry.format, plane, settings))
      able += (able.empty() ? "" : ", ") + std::string(entry.name) + " (" + std::string(entry.media_type) + ")";
  return able;
}

Result<ImageChoice> choose_image(const Request& request, const Settings& settings) {
  QueryErrors errors;
  const bool partial = read_partial(request, errors);
  const auto plane = read_plane(request, errors);
  check_format(request, errors);
  const JpegOptions jpeg = read_jpeg(request, errors);
  if (!errors.empty()) return std::move(errors).as_problem();
  if (plane->plane.aov && !settings.aovs.contains(*plane->plane.aov))
    return Problem{
        ProblemCode::not_found,
        "The job didn't record " + std::string(plane->name) + "; ask for it in /settings/aovs when you submit it.",
        {}};
  const auto format = choose_format(request, *plane, settings);
  if (!format) return format.problem();
  check_only_jpeg(request, *format, errors);
  if (!errors.empty()) return std::move(errors).as_problem();
  return ImageChoice{plane->plane, *format, jpeg, partial};
}

}  // namespace tessera::server
