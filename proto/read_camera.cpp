#include "proto/read_camera.h"

#include <cmath>
#include <numbers>
#include <string>

#include "core/math/portable.h"
#include "proto/read_values.h"

namespace tessera::proto {
namespace {

enum class CameraType { perspective, orthographic };

constexpr NumberRange kFieldOfView{0, 180, true, "an angle in degrees, greater than 0 and less than 180"};
constexpr float kDefaultFieldOfView = 45;

constexpr NumberRange kAzimuth{-360, 360, false, "an angle in degrees from -360 to 360"};
constexpr NumberRange kElevation{-90, 90, false, "an angle in degrees from -90 to 90"};
constexpr float kDefaultAzimuth = 30, kDefaultElevation = 20;

constexpr NumberRange kFocusDistance{0, 1e18F, true,
                                     "a distance in front of the camera, greater than 0 and less than 1e18"};
constexpr NumberRange kFocalLength{1e-6F, 1e9F, false, "a number of pixels from 1e-6 to 1e9"};
constexpr NumberRange kPixel{-1e9F, 1e9F, false, "a number of pixels from -1e9 to 1e9"};

// The sine of the angle between view and up below which "up" says too little about the picture's upright.
constexpr double kSmallestSine = 1e-6;

/// From where it looks, around the y axis from +z on, and above the horizon. From straight above, what is at the back
/// is up.
bool read_angles(std::optional<JsonCursor> azimuth, std::optional<JsonCursor> elevation, View& view) {
  float around = kDefaultAzimuth, above = kDefaultElevation;
  bool good = read(azimuth, around, kAzimuth);
  good &= read(elevation, above, kElevation);
  if (!good) return false;
  const double sideways = double{around} / 180 * std::numbers::pi, upwards = double{above} / 180 * std::numbers::pi;
  const double x = portable_sin(sideways), z = portable_cos(sideways), flat = portable_cos(upwards);
  view.from = {};
  if (std::abs(above) == 90) {
    const float way = above > 0 ? -1.0F : 1.0F;
    view.at = {0, way, 0};
    view.up = *UnitVec3::normalize(Vec3d{way * x, 0, way * z});
    return true;
  }
  view.at = *UnitVec3::normalize(Vec3d{-x * flat, -portable_sin(upwards), -z * flat});
  return true;
}

/// The view of a camera that leaves out where it stands.
bool read_unplaced(JsonFields& fields, View& view) {
  view = kUnplacedView;
  const auto given = fields.optional("direction"), azimuth = fields.optional("azimuth"),
             elevation = fields.optional("elevation");
  const auto angle = azimuth ? azimuth : elevation;
  if (given && angle) return angle->error("\"direction\" says this already; leave it or the angles out.");
  if (angle) return read_angles(azimuth, elevation, view);
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
  UnitVec3 upright = *UnitVec3::normalize(view.up);
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

/// Fields that say nothing of a camera that the server places, and words for why.
bool refuse_unplaced(const std::optional<JsonCursor>& field, std::string_view name) {
  return !field ||
         field->error(in_quotes(name) +
                      " goes with a camera that has a place; give it \"from\" and \"at\", or leave this out.");
}

/// What lies nearer or farther along the camera's axis isn't seen.
bool read_clipping(JsonFields& fields, bool is_placed, Clipping& clipping) {
  const auto near = fields.optional("near"), far = fields.optional("far");
  if (!is_placed) {
    const bool has_no_near = refuse_unplaced(near, "near");
    return refuse_unplaced(far, "far") && has_no_near;
  }
  bool good = read(near, clipping.near, kNotNegative);
  good &= read(far, clipping.far, kPositive);
  if (!good || clipping.near < clipping.far) return good;
  return far->error("\"far\" must be greater than \"near\", or nothing is seen between them.");
}

bool read_lens(JsonCursor value, Lens& lens) {
  JsonFields fields(value, "a lens");
  bool good = read(fields.required("radius"), lens.radius, kNotNegative);
  good &= read(fields.required("focus_distance"), lens.focus_distance, kFocusDistance);
  fields.refuse_unknown();
  return good;
}

bool read_intrinsics(JsonCursor value, std::optional<Intrinsics>& out) {
  JsonFields fields(value, "intrinsics");
  Intrinsics intrinsics{};
  bool good = read(fields.required("fx"), intrinsics.fx, kFocalLength);
  good &= read(fields.required("fy"), intrinsics.fy, kFocalLength);
  good &= read(fields.required("cx"), intrinsics.cx, kPixel);
  good &= read(fields.required("cy"), intrinsics.cy, kPixel);
  fields.refuse_unknown();
  if (good) out = intrinsics;
  return good;
}

bool read_field_of_view(JsonFields& fields, PerspectiveCamera& camera) {
  float degrees = kDefaultFieldOfView;
  const auto fov = fields.optional("fov"), intrinsics = fields.optional("intrinsics");
  if (fov && intrinsics) return fov->error("\"intrinsics\" tell the field of view; leave \"fov\" out.");
  if (!read(fov, degrees, kFieldOfView)) return false;
  camera.vertical_fov = radians(degrees);
  if (!(camera.vertical_fov < std::numbers::pi)) return fov->expected(kFieldOfView.words);  // rounded up to π
  if (!camera.view.is_placed) return refuse_unplaced(intrinsics, "intrinsics");
  return !intrinsics || read_intrinsics(*intrinsics, camera.intrinsics);
}

std::optional<Camera> read_perspective(JsonFields& fields) {
  fields.call("a perspective camera");
  PerspectiveCamera camera;
  bool good = read_view(fields, camera.view);
  good &= read_field_of_view(fields, camera);
  const auto lens = fields.optional("lens");
  if (lens) good &= camera.view.is_placed ? read_lens(*lens, camera.lens) : refuse_unplaced(lens, "lens");
  good &= read_clipping(fields, camera.view.is_placed, camera.clipping);
  return good ? std::optional<Camera>(camera) : std::nullopt;
}

std::optional<Camera> read_orthographic(JsonFields& fields) {
  fields.call("an orthographic camera");
  OrthographicCamera camera;
  bool good = read_view(fields, camera.view);
  if (camera.view.is_placed) {
    const auto height = fields.required("height");
    good &= height && read(height, camera.height, kPositive);
  }
  good &= read_clipping(fields, camera.view.is_placed, camera.clipping);
  return good ? std::optional<Camera>(camera) : std::nullopt;
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
  auto camera = type == CameraType::perspective ? read_perspective(fields) : read_orthographic(fields);
  fields.refuse_unknown();
  return camera;
}

}  // namespace tessera::proto
