#include "server/image_choice.h"

#include <algorithm>
#include <optional>
#include <string>

#include "server/media_type.h"

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
  static const std::vector<PlaneEntry> table = {
      {Plane::color, "", {png, jpeg, exr, hdr}},         {Plane::depth, "depth", {png, jpeg, exr}},
      {Plane::normal, "normal", {png, jpeg, exr, hdr}},  {Plane::primitive_id, "primitive_id", {png, jpeg, exr}},
      {Plane::object_id, "object_id", {png, jpeg, exr}}, {Plane::all, "all", {exr}},
  };
  return table;
}

namespace {

Problem malformed(std::string detail) { return {ProblemCode::malformed_request, std::move(detail), {}}; }

template <typename Entry>
std::string names_of(std::span<const Entry> table) {
  std::string text;
  for (const Entry& entry : table)
    if (!entry.name.empty()) text += (text.empty() ? "" : ", ") + std::string(entry.name);
  return text;
}

bool is_recorded(Plane plane, const std::set<Aov>& recorded) {
  switch (plane) {
    case Plane::depth:
      return recorded.contains(Aov::depth);
    case Plane::normal:
      return recorded.contains(Aov::normal);
    case Plane::primitive_id:
      return recorded.contains(Aov::primitive_id);
    case Plane::object_id:
      return recorded.contains(Aov::object_id);
    case Plane::color:
    case Plane::all:
      return true;
  }
  return false;
}

Result<PlaneEntry> choose_plane(const Request& request, const std::set<Aov>& recorded) {
  const std::string name(request.query("aov").value_or(""));
  const auto entry = std::ranges::find(plane_table(), std::string_view(name), &PlaneEntry::name);
  if (entry == plane_table().end() || (name.empty() && request.query("aov")))
    return malformed("There is no AOV \"" + name + "\"; known: " + names_of(plane_table()) + ".");
  if (!is_recorded(entry->plane, recorded))
    return Problem{ProblemCode::not_found,
                   "The job didn't record " + name + "; ask for it in /settings/aovs when you submit it.",
                   {}};
  return *entry;
}

Result<FormatEntry> choose_format(const Request& request, const PlaneEntry& plane) {
  const auto asked = request.query("format");
  if (asked && std::ranges::find(format_table(), *asked, &FormatEntry::name) == format_table().end())
    return malformed("There is no format \"" + std::string(*asked) + "\"; known: " + names_of(format_table()) + ".");
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

Result<bool> choose_partial(const Request& request) {
  const std::string_view value = request.query("partial").value_or("0");
  if (value != "0" && value != "1") return malformed("partial is 1 or 0.");
  return value == "1";
}

}  // namespace

Result<ImageChoice> choose_image(const Request& request, const std::set<Aov>& recorded) {
  const auto partial = choose_partial(request);
  if (!partial) return partial.problem();
  const auto plane = choose_plane(request, recorded);
  if (!plane) return plane.problem();
  const auto format = choose_format(request, *plane);
  if (!format) return format.problem();
  return ImageChoice{plane->plane, *format, *partial};
}

}  // namespace tessera::server
