#include "proto/read_camera.h"

#include <numbers>
#include <string>

#include "proto/read_values.h"

namespace tessera::proto {
namespace {

enum class CameraType { perspective, orthographic };

constexpr NumberRange kFieldOfView{0, 180, true, "an angle in degrees, greater than 0 and less than 180"};
constexpr float kDefaultFieldOfView = 45;

// The sine of the angle between view and up below which "up" says too little about the picture's upright.
constexpr double kSmallestSine = 1e-6;

/// The view of a camera that leaves out where it stands.
bool read_unplaced(JsonFields& fields, View& view) {
  view = kUnplacedView;
  const auto given = fields.optional("direction");
  UnitVec3 direction = UnitVec3::z();
  if (!given) return true;
  if (!read_direction(given, direction)) return false;
  view.from = {};
  view.at = direction;
  return true;
}

bool read_placed(std::optional<JsonCursor> at, std::optional<JsonCursor> from, View& view) {
  bool good = read(from, view.from, kCoordinate);
  good &= read(at, view.at, kCoordinate);
  if (!good) return false;
  if (view.at == view.from) return at->error("The camera looks at the point where it stands; move \"at\" or \"from\".");
  return true;
}

bool read_view(JsonFields& fields, View& view) {
  const auto at = fields.optional("at"), from = fields.optional("from"), up = fields.optional("up");
  bool good = false;
  if (at && from)
    good = read_placed(at, from, view);
  else if (!at && !from)
    good = read_unplaced(fields, view);
  else
    fields.value().error(
        std::string("The field \"") + (at ? "from" : "at") +
        "\" is missing; a camera has both of \"from\" and \"at\", or neither and is placed by the server.");
  UnitVec3 upright = UnitVec3::y();
  good &= read_direction(up, upright);
  if (!good) return false;
  const auto forward = UnitVec3::normalize(to_double(view.at) - to_double(view.from));
  if (length(cross(to_double(*forward), to_double(upright))) < kSmallestSine) {
    return up.value_or(fields.value())
        .error("\"up\" (by default [0, 1, 0]) is parallel to the way that the camera looks; choose another \"up\".");
  }
  view.up = upright;
  return true;
}

}  // namespace

std::optional<Camera> read_camera(JsonCursor value) {
  JsonFields fields(value, "a camera");
  CameraType type{};
  const auto type_field = fields.required("type");
  if (!type_field ||
      !read<CameraType>(type_field, type,
                        {{"perspective", CameraType::perspective}, {"orthographic", CameraType::orthographic}})) {
    return std::nullopt;
  }
  View view;
  std::optional<Camera> camera;
  bool good = false;
  if (type == CameraType::perspective) {
    fields.call("a perspective camera");
    good = read_view(fields, view);
    float degrees = kDefaultFieldOfView;
    const auto fov = fields.optional("fov");
    good &= read(fov, degrees, kFieldOfView);
    const auto radians = static_cast<float>(degrees * std::numbers::pi / 180);
    if (good && !(radians < std::numbers::pi)) good = fov->expected(kFieldOfView.words);  // rounded up to π
    if (good) camera = PerspectiveCamera{view, radians};
  } else {
    fields.call("an orthographic camera");
    good = read_view(fields, view);
    OrthographicCamera orthographic;
    if (view.is_placed) {
      const auto height = fields.required("height");
      good &= height && read(height, orthographic.height, kPositive);
    }
    orthographic.view = view;
    if (good) camera = orthographic;
  }
  fields.refuse_unknown();
  return camera;
}

}  // namespace tessera::proto
