#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "proto/import/gltf/views_and_lights.h"

namespace tessera::proto {
namespace {

/// What lies nearer or farther isn't seen. A far plane may be missing.
Clipping read_clipping(const GltfObject& object) {
  Clipping clipping;
  const auto near = object.required("znear"), far = object.find("zfar");
  read(near, clipping.near, kNotNegative);
  if (!read(far, clipping.far, kPositive)) return {};
  if (clipping.near < clipping.far) return clipping;
  far->error("\"zfar\" is greater than \"znear\".");
  return {};
}

Camera read_perspective(const GltfObject& object) {
  constexpr NumberRange kAngle{0, std::numbers::pi_v<float>, true, "an angle in radians between 0 and pi"};
  PerspectiveCamera camera;
  float aspect = 1;
  read(object.required("yfov"), camera.vertical_fov, kAngle);
  read(object.find("aspectRatio"), aspect, kPositive);
  camera.clipping = read_clipping(object);
  if (const auto near = object.find("znear"); near && near->is_number() && near->number() == 0)
    near->expected(kPositive.words);
  return camera;
}

Camera read_orthographic(const GltfObject& object) {
  OrthographicCamera camera;
  float half_width = 1, half_height = 1;
  read(object.required("xmag"), half_width);
  read(object.required("ymag"), half_height);
  object.required("zfar");
  for (const auto name : {"xmag", "ymag"}) {
    const auto field = object.find(name);
    if (field && field->is_number() && field->number() == 0) field->error("A camera's image has a size.");
  }
  camera.height = 2 * std::abs(half_height);
  camera.clipping = read_clipping(object);
  return camera;
}

GltfCamera read_camera(const GltfObject& object) {
  enum class Kind { perspective, orthographic } kind{};
  GltfCamera out{PerspectiveCamera{}, {}};
  const auto type = object.required("type"), name = object.find("name");
  if (name && name->kind() == JsonKind::string) out.name = name->string();
  if (!type || !read<Kind>(type, kind, {{"perspective", Kind::perspective}, {"orthographic", Kind::orthographic}}))
    return out;
  const std::string_view member = kind == Kind::perspective ? "perspective" : "orthographic";
  object.required(member);
  if (const auto lens = object.object(member))
    out.camera = kind == Kind::perspective ? read_perspective(*lens) : read_orthographic(*lens);
  return out;
}

}  // namespace

std::vector<GltfCamera> read_cameras(GltfFile& file) {
  std::vector<GltfCamera> cameras;
  for (const JsonCursor& camera : file.root().array("cameras")) cameras.push_back(read_camera(GltfObject(camera)));
  return cameras;
}

std::optional<Camera> placed(const Camera& camera, const Rows& to_world) {
  const Vec3d from = transform_point(to_world, {});
  const auto forward = UnitVec3::normalize(transform_vector(to_world, {0, 0, -1}));
  const auto up = UnitVec3::normalize(transform_vector(to_world, {0, 1, 0}));
  constexpr double kLargestPlace = 1e17;
  if (!forward || !up || !(max_component(abs(from)) < kLargestPlace)) return std::nullopt;
  if (!(length(cross(to_double(*forward), to_double(*up))) > 1e-6)) return std::nullopt;
  // So far ahead that rounding the place doesn't turn the view.
  const double ahead = std::max(1.0, max_component(abs(from)));
  View view;
  view.from = to_float(from);
  view.at = to_float(from + to_double(*forward) * ahead);
  view.up = *up;
  Camera out = camera;
  std::visit([&](auto& c) { c.view = view; }, out);
  return out;
}

}  // namespace tessera::proto
