#include "core/light/illuminate.h"

namespace tessera {
namespace {

/// The ray to a point light ends where t = 1. Both its end and a surface that carries the light are off by a few
/// roundings of the whole way, so it stops 16 of them short: a lamp is not in its own shadow.
constexpr float kJustBeforeLight = 1 - 16 * static_cast<float>(kUnitRoundoff);

}  // namespace

Illumination illuminate(const PointLight& light, Vec3 point) {
  const Vec3d way = to_double(light.position) - to_double(point);
  const auto direction = UnitVec3::normalize(way);
  if (!direction) return {UnitVec3::z(), {}, {point, {}}};
  const auto falloff = static_cast<float>(light.falls_off ? 1 / dot(way, way) : 1.0);
  return {*direction, light.intensity * falloff, {point, to_float(way), 0, kJustBeforeLight}};
}

Illumination illuminate(const DirectionalLight& light, Vec3 point) {
  const Vec3 to_light = -light.direction;
  return {to_light, light.irradiance, {point, to_light}};
}

}  // namespace tessera
