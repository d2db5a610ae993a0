#include "core/integrator/whitted.h"

#include "core/integrator/spawn.h"
#include "core/light/illuminate.h"
#include "core/material/shade.h"

namespace tessera {

/// A hit as shading sees it: normals turned towards the viewer.
struct Shading {
  SurfacePoint surface;
  Vec3 flat_normal;
  Vec3 normal;
  Vec3 to_viewer;
  bool entering;  ///< The ray came from outside.
};

namespace {

Shading shading_at(const SurfacePoint& surface, Vec3 direction) {
  const bool entering = dot(to_double(direction), surface.geometric_normal) < 0;
  const Vec3 flat = to_float(entering ? surface.geometric_normal : -surface.geometric_normal);
  const Vec3 smooth = to_float(entering ? surface.shading_normal : -surface.shading_normal);
  // An interpolated normal may point away from a viewer that sees the surface; the flat one never does.
  return {surface, flat, dot(direction, smooth) < 0 ? smooth : flat, -direction, entering};
}

/// Mirrored at the shading normal, or at the flat one where that would lead into the surface.
Vec3 mirrored(Vec3 direction, const Shading& at) {
  const Vec3 smooth = mirror(direction, at.normal);
  return dot(smooth, at.flat_normal) > 0 ? smooth : mirror(direction, at.flat_normal);
}

/// Bent at the shading normal, or at the flat one where that would lead back out.
std::optional<Vec3> refracted(Vec3 direction, const Shading& at, float eta) {
  const auto smooth = refract(direction, at.normal, eta);
  return !smooth || dot(*smooth, at.flat_normal) < 0 ? smooth : refract(direction, at.flat_normal, eta);
}

}  // namespace

Rgb Whitted::radiance(const Ray& ray, const std::optional<Hit>& hit, std::uint32_t depth) {
  if (!hit) return scene_.background;
  const Material& material = scene_.materials[scene_.objects[hit->object].material];
  const Vec3 direction = UnitVec3::normalize(ray.direction).value_or(UnitVec3::z());
  const Shading at = shading_at(world_surface(scene_, hit->object, hit->primitive, ray, hit->t), direction);

  Rgb sum = direct(material, at);
  if (depth == max_depth_) return sum;

  const float eta = at.entering ? material.ior : 1 / material.ior;
  const float reflected = material.fresnel ? fresnel(direction, at.normal, eta) : 1;
  const float passed = material.fresnel ? 1 - reflected : 1;
  if (!material.reflect.is_black()) {
    ++counts_.reflection;
    sum = sum + material.reflect * reflected *
                    follow(spawn_origin(at.surface, to_double(at.to_viewer)), mirrored(direction, at), depth);
  }
  if (!material.transmit.is_black())
    if (const auto bent = refracted(direction, at, eta)) {
      ++counts_.refraction;
      sum = sum + material.transmit * passed * follow(spawn_origin(at.surface, to_double(direction)), *bent, depth);
    }
  return sum;
}

Rgb Whitted::direct(const Material& material, const Shading& at) {
  Rgb sum;
  const Vec3 origin = spawn_origin(at.surface, to_double(at.to_viewer));
  for (const Light& light : scene_.lights)
    std::visit(
        [&](const auto& source) {
          if constexpr (std::is_same_v<std::decay_t<decltype(source)>, AmbientLight>) {
            sum = sum + material.diffuse * source.radiance;
          } else {
            const Illumination in = illuminate(source, origin);
            const Rgb lit = shade(material, at.normal, at.to_viewer, in.to_light, in.irradiance);
            if (lit.is_black()) return;
            ++counts_.shadow;
            if (!accel_.occluded(in.shadow_ray, log_)) sum = sum + lit;
          }
        },
        light);
  return sum;
}

Rgb Whitted::follow(Vec3 origin, Vec3 direction, std::uint32_t depth) {
  if (stop_.stop_requested()) return {};
  const Ray ray{origin, direction};
  return radiance(ray, accel_.closest(ray, log_), depth + 1);
}

}  // namespace tessera
