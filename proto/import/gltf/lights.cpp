#include <array>
#include <limits>
#include <numbers>
#include <variant>

#include "core/geometry/triangle_mesh.h"
#include "proto/import/gltf/views_and_lights.h"
#include "proto/read_values.h"

namespace tessera::proto {
namespace {

constexpr float kRightAngle = std::numbers::pi_v<float> / 2;

std::optional<Light> read_light(GltfFile& file, const GltfObject& object) {
  std::array<float, 3> color{1, 1, 1};
  float intensity = 1;
  const auto type = object.required("type"), range = object.find("range");
  read_numbers(object.find("color"), color, kLightChannel);
  read(object.find("intensity"), intensity, kLightChannel);
  if (range) file.note(*range, "The range of a light is ignored: light goes on");
  const Rgb strength = Rgb{color[0], color[1], color[2]} * intensity;
  if (!type) return std::nullopt;
  enum class Kind { point, directional, spot } kind{};
  if (!read<Kind>(type, kind, {{"point", Kind::point}, {"directional", Kind::directional}, {"spot", Kind::spot}}))
    return std::nullopt;
  if (kind == Kind::point) return PointLight{{}, strength, true};
  if (kind == Kind::directional) return DirectionalLight{-UnitVec3::z(), strength};

  SpotLight spot{.position = {}, .intensity = strength};
  spot.outer_angle = std::numbers::pi_v<float> / 4;
  constexpr NumberRange kInner{0, kRightAngle, false, "an angle in radians from 0 to pi/2"};
  constexpr NumberRange kOuter{0, std::numeric_limits<float>::infinity(), true, "an angle in radians, above 0"};
  if (const auto cone = object.object("spot")) {
    read(cone->find("innerConeAngle"), spot.inner_angle, kInner);
    read(cone->find("outerConeAngle"), spot.outer_angle, kOuter);
    if (spot.outer_angle > kRightAngle) {
      cone->find("outerConeAngle")->expected("an angle in radians, above 0 and at most pi/2");
    } else if (spot.inner_angle >= spot.outer_angle) {
      cone->value().error("A spot light's inner cone is narrower than its outer cone.");
    }
  } else {
    object.required("spot");
  }
  return spot;
}

}  // namespace

std::vector<Light> read_lights(GltfFile& file) {
  std::vector<Light> lights;
  const auto extension = file.root().extension("KHR_lights_punctual");
  if (!extension) return lights;
  for (const JsonCursor& light : extension->array("lights"))
    lights.push_back(read_light(file, GltfObject(light)).value_or(PointLight{}));
  return lights;
}

std::optional<Light> placed(const Light& light, const Rows& to_world) {
  const Vec3 position = to_float(transform_point(to_world, {}));
  const auto direction = UnitVec3::normalize(transform_vector(to_world, {0, 0, -1}));
  if (!(max_component(abs(position)) <= kLargestCoordinate)) return std::nullopt;
  if (!direction && !std::holds_alternative<PointLight>(light)) return std::nullopt;
  Light out = light;
  if (auto* point = std::get_if<PointLight>(&out)) point->position = position;
  if (auto* sun = std::get_if<DirectionalLight>(&out)) sun->direction = *direction;
  if (auto* spot = std::get_if<SpotLight>(&out)) {
    spot->position = position;
    spot->direction = *direction;
  }
  return out;
}

}  // namespace tessera::proto
