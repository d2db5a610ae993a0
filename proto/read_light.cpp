#include "proto/read_light.h"

#include <cmath>
#include <memory>

#include "core/scene/studio.h"
#include "proto/read_transform.h"
#include "proto/read_values.h"

namespace tessera::proto {
namespace {

enum class LightType { point, directional, ambient, spot, sun, environment };

constexpr NumberRange kInnerAngle{0, 90, false, "an angle in degrees from 0 to 90"};
constexpr NumberRange kOuterAngle{1e-3F, 90, false, "an angle in degrees from 0.001 to 90"};
constexpr NumberRange kSunAngle{0.01F, 180, false,
                                "a diameter in degrees from 0.01 to 180 (a directional light has none)"};
constexpr float kDefaultSunAngle = 0.53F;

Light read_point(JsonFields& fields) {
  fields.call("a point light");
  PointLight light;
  read(fields.required("position"), light.position, kCoordinate);
  read_color(fields.required("intensity"), light.intensity, kLightChannel);
  read<bool>(fields.optional("falloff"), light.falls_off, {{"inverse_square", true}, {"none", false}});
  return light;
}

Light read_directional(JsonFields& fields) {
  fields.call("a directional light");
  DirectionalLight light;
  read_direction(fields.required("direction"), light.direction);
  read_color(fields.required("irradiance"), light.irradiance, kLightChannel);
  return light;
}

Light read_ambient(JsonFields& fields) {
  fields.call("an ambient light");
  AmbientLight light;
  read_color(fields.required("radiance"), light.radiance, kLightChannel);
  return light;
}

Light read_spot(JsonFields& fields) {
  fields.call("a spot light");
  SpotLight light;
  read(fields.required("position"), light.position, kCoordinate);
  read_direction(fields.required("direction"), light.direction);
  read_color(fields.required("intensity"), light.intensity, kLightChannel);
  const auto inner_field = fields.optional("inner_angle"), outer_field = fields.required("outer_angle");
  float inner = 0, outer = 0;
  const bool good = read(inner_field, inner, kInnerAngle) && read(outer_field, outer, kOuterAngle);
  if (good && outer_field && inner > outer)
    inner_field->error("\"inner_angle\" must be at most \"outer_angle\": from the one to the other the light fades.");
  light.inner_angle = radians(inner);
  light.outer_angle = radians(outer);
  return light;
}

Light read_sun(JsonFields& fields) {
  fields.call("a sun");
  SunLight light;
  read_direction(fields.required("direction"), light.direction);
  read_color(fields.required("irradiance"), light.irradiance, kLightChannel);
  float angle = kDefaultSunAngle;
  read(fields.optional("angle"), angle, kSunAngle);
  light.angle = radians(angle);
  return light;
}

/// A rotation, perhaps mirrored, and nothing else: rows of length 1 that are perpendicular to each other.
bool read_rotation(JsonCursor value, std::array<float, 9>& rotation) {
  constexpr double kRounding = 1e-5;  // of numbers that are written with six digits
  const auto transform = read_transform(value);
  if (!transform) return false;
  const std::array<double, 12>& rows = transform->rows();
  bool is_rotation = true;
  for (std::size_t i = 0; i < 3; ++i) {
    is_rotation &= rows[i * 4 + 3] == 0;
    for (std::size_t j = 0; j < 3; ++j) {
      const double product =
          rows[i * 4] * rows[j * 4] + rows[i * 4 + 1] * rows[j * 4 + 1] + rows[i * 4 + 2] * rows[j * 4 + 2];
      is_rotation &= std::abs(product - (i == j ? 1 : 0)) <= kRounding;
      rotation[i * 3 + j] = static_cast<float>(rows[i * 4 + j]);
    }
  }
  return is_rotation ||
         value.error("An environment is infinitely far away, so it can only be turned: give a rotation.");
}

/// The map that one of several fields tells; whether one does.
bool read_map(JsonFields& fields, FileLoader& files, std::shared_ptr<const EnvironmentMap>& map) {
  const auto preset = fields.optional("preset");
  const bool is_in_file = files.find_environment(fields, map);
  if (!preset) return is_in_file;
  if (is_in_file)
    fields.value().error("An environment's map is a preset, or it comes from a file; leave one of them out.");
  bool is_studio = false;
  if (read<bool>(preset, is_studio, {{"studio", true}}) && !is_in_file) map = studio_environment();
  return true;
}

Light read_environment(JsonFields& fields, FileLoader& files) {
  fields.call("an environment");
  EnvironmentLight light;
  read_color(fields.optional("radiance"), light.radiance, kLightChannel);
  const bool has_map = read_map(fields, files, light.map);
  const auto transform = fields.optional("transform");
  if (transform && !has_map) transform->error("An environment without a map is the same all around; leave this out.");
  if (transform && has_map) read_rotation(*transform, light.to_world);
  return light;
}

Light read_fields(LightType type, JsonFields& fields, FileLoader& files) {
  switch (type) {
    case LightType::point:
      return read_point(fields);
    case LightType::directional:
      return read_directional(fields);
    case LightType::ambient:
      return read_ambient(fields);
    case LightType::spot:
      return read_spot(fields);
    case LightType::sun:
      return read_sun(fields);
    case LightType::environment:
      return read_environment(fields, files);
  }
  return {};
}

}  // namespace

std::optional<ReadLight> read_light(JsonCursor value, FileLoader& files) {
  JsonFields fields(value, "a light");
  LightType type{};
  const auto type_field = fields.required("type");
  if (!type_field || !read<LightType>(type_field, type,
                                      {{"point", LightType::point},
                                       {"directional", LightType::directional},
                                       {"ambient", LightType::ambient},
                                       {"spot", LightType::spot},
                                       {"sun", LightType::sun},
                                       {"environment", LightType::environment}})) {
    return std::nullopt;
  }
  ReadLight read;
  read.light = read_fields(type, fields, files);
  tessera::proto::read(fields.optional("only_without_lights"), read.only_without_lights);
  fields.refuse_unknown();
  return read;
}

}  // namespace tessera::proto
