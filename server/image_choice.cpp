#include "server/image_choice.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "proto/names.h"
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
  using enum ImageFormat;
  const auto row = [](Plane plane, Aov aov, std::set<ImageFormat> formats) {
    return PlaneEntry{plane, aov, name_of(proto::aov_names(), aov), std::move(formats)};
  };
  static const std::vector<PlaneEntry> table = {
      {Plane::color, std::nullopt, "", {png, jpeg, exr, hdr}},
      row(Plane::depth, Aov::depth, {png, jpeg, exr}),
      row(Plane::normal, Aov::normal, {png, jpeg, exr, hdr}),
      row(Plane::primitive_id, Aov::primitive_id, {png, jpeg, exr}),
      row(Plane::object_id, Aov::object_id, {png, jpeg, exr}),
      row(Plane::cost_volumes, Aov::cost_volumes, {png, jpeg, exr, hdr}),
      row(Plane::cost_primitives, Aov::cost_primitives, {png, jpeg, exr, hdr}),
      {Plane::all, std::nullopt, "all", {exr}},
  };
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

/// Precondition: `format`, where it is asked for, is known.
Result<FormatEntry> choose_format(const Request& request, const PlaneEntry& plane) {
  const auto asked = request.query("format");
  const std::string_view accept = request.header("accept").value_or("*/*");
  std::optional<FormatEntry> best;
  double best_weight = 0;
  for (const FormatEntry& entry : format_table()) {
    if (!plane.formats.contains(entry.format)) continue;
    const double weight = asked ? (entry.name == *asked ? 1 : 0) : acceptance(accept, entry.media_type);
    if (weight > best_weight) {
      best = entry;
      best_weight = weight;
    }
  }
  if (best) return *best;
  std::string able;
  for (const FormatEntry& entry : format_table())
    if (plane.formats.contains(entry.format))
      able += (able.empty() ? "" : ", ") + std::string(entry.name) + " (" + std::string(entry.media_type) + ")";
  return Problem{ProblemCode::not_acceptable, "This image comes as " + able + ".", {}};
}

}  // namespace

Result<ImageChoice> choose_image(const Request& request, const std::set<Aov>& recorded) {
  QueryErrors errors;
  const bool partial = read_partial(request, errors);
  const auto plane = read_plane(request, errors);
  check_format(request, errors);
  if (!errors.empty()) return std::move(errors).as_problem();
  if (plane->aov && !recorded.contains(*plane->aov))
    return Problem{
        ProblemCode::not_found,
        "The job didn't record " + std::string(plane->name) + "; ask for it in /settings/aovs when you submit it.",
        {}};
  const auto format = choose_format(request, *plane);
  if (!format) return format.problem();
  return ImageChoice{plane->plane, *format, partial};
}

}  // namespace tessera::server
