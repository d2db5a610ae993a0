#include "proto/read_light.h"

#include "proto/read_values.h"

namespace tessera::proto {
namespace {

enum class LightType { point, directional, ambient };

Light read_point(JsonFields& fields) {
  fields.call("a point light");
  PointLight light;
  read(fields.required("position"), light.position, kCoordinate);
  read_color(fields.required("intensity"), light.intensity, kNotNegative);
  read<bool>(fields.optional("falloff"), light.falls_off, {{"inverse_square", true}, {"none", false}});
  return light;
}

Light read_directional(JsonFields& fields) {
  fields.call("a directional light");
  DirectionalLight light;
  read_direction(fields.required("direction"), light.direction);
  read_color(fields.required("irradiance"), light.irradiance, kNotNegative);
  return light;
}

Light read_ambient(JsonFields& fields) {
  fields.call("an ambient light");
  AmbientLight light;
  read_color(fields.required("radiance"), light.radiance, kNotNegative);
  return light;
}

}  // namespace

std::optional<Light> read_light(JsonCursor value) {
  JsonFields fields(value, "a light");
  LightType type{};
  const auto type_field = fields.required("type");
  if (!type_field ||
      !read<LightType>(
          type_field, type,
          {{"point", LightType::point}, {"directional", LightType::directional}, {"ambient", LightType::ambient}})) {
    return std::nullopt;
  }
  const Light light = type == LightType::point         ? read_point(fields)
                      : type == LightType::directional ? read_directional(fields)
                                                       : read_ambient(fields);
  fields.refuse_unknown();
  return light;
}

}  // namespace tessera::proto
