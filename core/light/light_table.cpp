#include "core/light/light_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/light/emissive_surface.h"
#include "core/light/illuminate.h"
#include "core/material/surface_at.h"
#include "core/math/float_environment.h"
#include "core/math/portable_float.h"
#include "core/sampling/sampler.h"
#include "core/sampling/warp.h"

namespace tessera {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFF;

/// Of the lights that are near, and of those infinitely far away, as long as either sends anything. What stands before
/// them isn't known, and not all that is known is exact.
constexpr double kLeastShare = 0.1;

LightBounds bounds_of(const PointLight& light) {
  return {.box = {light.position, light.position}, .intensity = mean(light.intensity)};
}

LightBounds bounds_of(const SpotLight& light) {
  return {{light.position, light.position},
          light.direction,
          portable_sin_cos(light.inner_angle).cos,
          portable_sin_cos(light.outer_angle - light.inner_angle).cos,
          false,
          mean(light.intensity)};
}

/// What is left of a spot's intensity at an angle from its axis, all by their cosines.
double falloff(double cosine, double inner, double outer) {
  if (cosine <= outer) return 0;
  if (cosine >= inner) return 1;
  const double x = (cosine - outer) / (inner - outer);
  return x * x * (3 - 2 * x);
}

/// From a place, when a share of the intensity goes that way.
template <typename Falloff>
std::optional<LightSample> sample_at(Vec3 position, Rgb intensity, Vec3d from, Falloff falloff) {
  const Vec3d way = to_double(position) - from;
  const double square = dot(way, way), distance = std::sqrt(square);
  const auto direction = UnitVec3::normalize(way);
  if (!direction) return std::nullopt;
  const Rgb irradiance = intensity * static_cast<float>(falloff(way / -distance) / square);
  if (irradiance.is_black() || !is_finite(irradiance)) return std::nullopt;
  return LightSample{*direction, static_cast<float>(distance), irradiance, 1, true, to_double(position), kNoPrimitive};
}

/// What a triangle's second and third corner count for at a point in it.
struct Shares {
  double second, third;
};
Shares shares_at(const WorldTriangle& triangle, Vec3d point) {
  const Vec3d a = to_double(triangle[0]), ab = to_double(triangle[1]) - a, ac = to_double(triangle[2]) - a;
  const Vec3d normal = cross(ab, ac), way = point - a;
  const double square = dot(normal, normal);
  return {std::clamp(dot(cross(way, ac), normal) / square, 0.0, 1.0),
          std::clamp(dot(cross(ab, way), normal) / square, 0.0, 1.0)};
}

}  // namespace

std::shared_ptr<const LightTable> make_lights(std::shared_ptr<const Scene> scene) {
  const StrictFloats strict;
  return std::make_shared<const LightTable>(std::move(scene));
}

LightTable::LightTable(std::shared_ptr<const Scene> scene)
    : scene_(std::move(scene)),
      far_(*scene_),
      first_(scene_->objects.size(), kNone),
      errors_(scene_->objects.size()),
      near_(gather_near()) {
  gather_emitters();
}

std::size_t LightTable::bytes() const {
  return far_.bytes() + near_.bytes() + sources_.capacity() * sizeof(PrimitiveId) +
         first_.capacity() * sizeof(std::uint32_t) + triangles_.capacity() * sizeof(WorldTriangle) +
         spots_.capacity() * sizeof(SpotCosines) + errors_.capacity() * sizeof(Transform::Error) +
         emitters_.capacity() * sizeof(Aabb);
}

void LightTable::gather_emitters() {
  constexpr std::size_t kMostBoxes = 8;
  constexpr float kRoom = 0x1p-10F;
  for (const Object& object : scene_->objects) {
    if (scene_->materials[object.material].emission.is_black()) continue;
    Aabb box = world_bounds(*scene_, object);
    if (box.empty()) continue;
    const Vec3 room = max(abs(box.lo), abs(box.hi)) * kRoom;
    emitters_.push_back({box.lo - room, box.hi + room});
  }
  if (emitters_.size() <= kMostBoxes) return;
  for (const Aabb& box : emitters_) emitters_[0].extend(box);
  emitters_.resize(1);
  emitters_.shrink_to_fit();
}

bool LightTable::may_meet(const Ray& ray) const {
  const Vec3d origin = to_double(ray.origin), direction = to_double(ray.direction);
  // Rays far away from a box see it less exactly.
  const double room = 0x1p-20 * max_component(abs(origin));
  return std::ranges::any_of(emitters_, [&](const Aabb& box) {
    double enter = 0, leave = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      const double lo = box.lo[axis] - room - origin[axis], hi = box.hi[axis] + room - origin[axis];
      if (direction[axis] == 0) {
        if (lo > 0 || hi < 0) return false;
        continue;
      }
      const double a = lo / direction[axis], b = hi / direction[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter <= leave;
  });
}

LightTree LightTable::gather_near() {
  std::vector<LightBounds> bounds;
  const auto add = [&](PrimitiveId source, const LightBounds& light) {
    sources_.push_back(source);
    bounds.push_back(light);
  };
  for (std::uint32_t i = 0; i < scene_->lights.size(); ++i) {
    const auto* point = std::get_if<PointLight>(&scene_->lights[i]);
    const auto* spot = std::get_if<SpotLight>(&scene_->lights[i]);
    if (point && point->falls_off) add({kNone, i}, bounds_of(*point));
    if (!spot) continue;
    add({kNone, i}, bounds_of(*spot));
    spots_.resize(scene_->lights.size());
    spots_[i] = {portable_sin_cos(spot->inner_angle).cos, portable_sin_cos(spot->outer_angle).cos};
  }
  for (std::uint32_t i = 0; i < scene_->objects.size(); ++i) {
    const Object& object = scene_->objects[i];
    const Shape& shape = scene_->shapes[object.shape];
    const Material& material = scene_->materials[object.material];
    if (!is_lamp(material) || !can_be_sampled(shape)) continue;
    first_[i] = static_cast<std::uint32_t>(sources_.size());
    if (object.placement) errors_[i] = object.placement->error();
    if (const auto* mesh = std::get_if<TriangleMesh>(&shape)) {
      triangles_.resize(sources_.size());
      for (std::uint32_t t = 0; t < mesh->triangles.size(); ++t) triangles_.push_back(world_triangle(object, *mesh, t));
    }
    for (std::uint32_t primitive = 0; primitive < primitive_count(shape); ++primitive) {
      const double radiance = mean_emission(*scene_, object, primitive) * material.alpha;
      add({i, primitive}, surface_bounds(*scene_, {i, primitive}, radiance, material.emits_both_sides));
    }
  }
  return LightTree(bounds);
}

LightTable::Viewpoint LightTable::viewpoint(Vec3d point, Vec3 normal) const {
  Viewpoint from{point, normal, far_.sum(normal), 0};
  if (!(from.far.irradiance > 0)) return from;
  const double near = near_.size() == 0 ? 0 : near_.irradiance(point, normal);
  from.far_share =
      near > 0 ? std::clamp(from.far.irradiance / (from.far.irradiance + near), kLeastShare, 1 - kLeastShare) : 1;
  return from;
}

std::optional<LightSample> LightTable::sample(const Viewpoint& from, float pick, Vec2 u) const {
  if (empty()) return std::nullopt;
  const double x = std::clamp(joined({u.x, pick}), 0.0, 1 - 0x1p-53);
  const bool far = x < from.far_share;
  if (!far && near_.size() == 0) return std::nullopt;
  const double share = far ? from.far_share : 1 - from.far_share;
  const double rest = (far ? x : x - from.far_share) / share;
  auto found = far ? sample_far(from, rest, u) : sample_near(from, rest, u);
  if (!found) return std::nullopt;
  found->pdf = static_cast<float>(found->pdf * share);
  if (!(found->pdf > 0) || !std::isfinite(found->pdf)) return std::nullopt;
  return found;
}

std::optional<LightSample> LightTable::sample_far(const Viewpoint& from, double pick, Vec2 u) const {
  const auto found = far_.sample(from.normal, from.far, pick, u);
  if (!found) return std::nullopt;
  return LightSample{found->direction, kInfinity, found->radiance, static_cast<float>(found->pdf),
                     found->is_delta,  {},        kNoPrimitive};
}

std::optional<LightSample> LightTable::sample_point(std::uint32_t light, Vec3d from) const {
  if (const auto* point = std::get_if<PointLight>(&scene_->lights[light]))
    return sample_at(point->position, point->intensity, from, [](Vec3d) { return 1.0; });
  const auto& spot = std::get<SpotLight>(scene_->lights[light]);
  const auto [inner, outer] = spots_[light];
  return sample_at(spot.position, spot.intensity, from,
                   [&](Vec3d way) { return falloff(dot(way, to_double(spot.direction)), inner, outer); });
}

std::optional<LightSample> LightTable::sample_near(const Viewpoint& from, double pick, Vec2 u) const {
  const auto [light, probability, rest] = near_.pick(from.point, from.normal, pick);
  u.x = below_one(rest);
  const PrimitiveId source = sources_[light];
  if (source.object == kNone) {
    auto found = sample_point(source.primitive, from.point);
    if (found) found->pdf = static_cast<float>(probability);
    return found;
  }
  const Object& object = scene_->objects[source.object];
  const Material& material = scene_->materials[object.material];
  const WorldTriangle* triangle = triangle_of(light);
  const auto found =
      triangle ? sample_surface(*triangle, from.point, u) : sample_surface(*scene_, source, from.point, u);
  if (!found || !(found->front || material.emits_both_sides)) return std::nullopt;
  const double distance = length(found->way);
  Rgb emission = material.emission;
  if (triangle && has_texture(material, TextureSlot::emission)) {
    const Shares at = shares_at(*triangle, from.point + found->way);
    emission = emission_at(*scene_, object, source.primitive, at.second, at.third);
  }
  return LightSample{to_float(found->way / distance),
                     static_cast<float>(distance),
                     emission * material.alpha,
                     static_cast<float>(probability * found->pdf),
                     false,
                     from.point + found->way,
                     source};
}

Ray LightTable::shadow_ray(const LightSample& sample, Vec3 origin) const {
  if (sample.distance == kInfinity) return {origin, sample.to_light};
  Ray ray{origin, to_float(sample.position - to_double(origin)), 0, kInfinity};
  ray.t_max = end_at(sample.primitive, ray) * kJustBeforeLight;
  return ray;
}

/// Where a ray meets the light that its point at t = 1 was chosen on.
float LightTable::end_at(PrimitiveId primitive, const Ray& ray) const {
  if (primitive.object == kNone) return 1;
  if (const WorldTriangle* triangle = triangle_of(first_[primitive.object] + primitive.primitive)) {
    const Transform::Error& placed = errors_[primitive.object];
    const double reach =
        2.0 * max_component(abs(ray.origin)) + max_component(abs((*triangle)[0])) + max_component(abs(ray.direction));
    // Twice `Transform::Error`'s bound: the corners here are rounded to floats, too.
    const double error = 16 * kUnitRoundoff * (placed.condition * reach + placed.offset);
    if (const auto t = t_before(*triangle, ray, error)) return *t;
  }
  return t_near_one(*scene_, primitive, ray).value_or(1);
}

const WorldTriangle* LightTable::triangle_of(std::uint32_t source) const {
  if (source >= triangles_.size() || sources_[source].object == kNone) return nullptr;
  const Shape& shape = scene_->shapes[scene_->objects[sources_[source].object].shape];
  return std::holds_alternative<TriangleMesh>(shape) ? &triangles_[source] : nullptr;
}

float LightTable::pdf_hit(const Viewpoint& from, Vec3 direction, PrimitiveId primitive, double distance,
                          Vec3d geometric_normal) const {
  const std::uint32_t first = first_[primitive.object];
  if (first == kNone) return 0;
  const double probability =
      (1 - from.far_share) * near_.probability(first + primitive.primitive, from.point, from.normal);
  if (probability == 0) return 0;
  const WorldTriangle* triangle = triangle_of(first + primitive.primitive);
  const double pdf = triangle ? surface_pdf(*triangle, from.point, direction, distance)
                              : surface_pdf(*scene_, primitive, from.point, direction, distance, geometric_normal);
  return static_cast<float>(std::min(pdf * probability, double{std::numeric_limits<float>::max()}));
}

LightTable::Escaped LightTable::escaped(const Viewpoint& from, Vec3 direction) const {
  const InfiniteLights::Value value = far_.look_up(from.normal, from.far, direction);
  return {value.radiance, static_cast<float>(from.far_share * value.pdf)};
}

}  // namespace tessera
