#include "core/light/illuminate.h"

namespace tessera {
Illumination illuminate(const PointLight& light, Vec3 point) {
  const Vec3d way = to_double(light.position) - to_double(point);
  const auto direction = UnitVec3::normalize(way);
  if (!direction) return {UnitVec3::z(), {}};
  const auto falloff = static_cast<float>(light.falls_off ? 1 / dot(way, way) : 1.0);
  return {*direction, light.intensity * falloff};
}

Illumination illuminate(const DirectionalLight& light, Vec3) { return {-light.direction, light.irradiance}; }

Ray shadow_ray(const PointLight& light, Vec3 from) {
  return {from, to_float(to_double(light.position) - to_double(from)), 0, kJustBeforeLight};
}

Ray shadow_ray(const DirectionalLight& light, Vec3 from) { return {from, -light.direction}; }

}  // namespace tessera
