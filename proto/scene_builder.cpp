#include "proto/scene_builder.h"

#include <algorithm>
#include <array>
#include <set>
#include <utility>
#include <variant>

#include "core/math/float_environment.h"
#include "core/math/orientation.h"
#include "core/plan/features.h"

namespace tessera::proto {
namespace {

constexpr std::uint32_t kUnused = 0xFFFFFFFF;

std::uint64_t shape_bytes(const Shape& shape) {
  const auto* mesh = std::get_if<TriangleMesh>(&shape);
  if (mesh == nullptr) return sizeof(Shape) + sizeof(Aabb);
  return sizeof(Shape) + sizeof(Aabb) + (mesh->positions.size() + mesh->normals.size()) * sizeof(Vec3) +
         mesh->triangles.size() * sizeof(TriangleIndices) + (mesh->attributes ? memory_bytes(*mesh->attributes) : 0);
}

bool is_dark(const PointLight& light) { return light.intensity.is_black(); }
bool is_dark(const DirectionalLight& light) { return light.irradiance.is_black(); }
bool is_dark(const AmbientLight& light) { return light.radiance.is_black(); }
bool is_dark(const SpotLight& light) { return light.intensity.is_black(); }
bool is_dark(const SunLight& light) { return light.irradiance.is_black(); }
bool is_dark(const EnvironmentLight& light) { return is_black(light); }

bool is_line(const std::array<Vec3, 3>& corners) {
  for (int axis = 0; axis < 3; ++axis)
    if (orientation_along(axis, corners[0], corners[1], corners[2]) != 0) return false;
  return true;
}

bool has_area(const Shape& shape) {
  const auto* mesh = std::get_if<TriangleMesh>(&shape);
  return mesh == nullptr || std::ranges::any_of(mesh->triangles, [&](const TriangleIndices& t) {
           return !is_line({mesh->positions[t[0]], mesh->positions[t[1]], mesh->positions[t[2]]});
         });
}

void drop_unplaced_shapes(Scene& scene) {
  std::vector<std::uint32_t> moved_to(scene.shapes.size(), kUnused);
  for (const Object& object : scene.objects) moved_to[object.shape] = 0;
  std::uint32_t kept = 0;
  for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
    if (moved_to[i] == kUnused) continue;
    if (kept != i) {
      scene.shapes[kept] = std::move(scene.shapes[i]);
      scene.shape_bounds[kept] = scene.shape_bounds[i];
    }
    moved_to[i] = kept++;
  }
  scene.shapes.resize(kept);
  scene.shape_bounds.resize(kept);
  for (Object& object : scene.objects) object.shape = moved_to[object.shape];
}

}  // namespace

std::uint32_t SceneBuilder::add_material(const Material& material) {
  scene_.materials.push_back(material);
  return static_cast<std::uint32_t>(scene_.materials.size() - 1);
}

std::optional<std::uint32_t> SceneBuilder::add_textures(const std::vector<Texture>& textures, const JsonCursor& where) {
  std::set<const TextureImage*> images;
  for (const Texture& texture : textures)
    if (images.insert(texture.image.get()).second && !take(texture.image->bytes(), where)) return std::nullopt;
  const auto first = static_cast<std::uint32_t>(scene_.textures.size());
  scene_.textures.insert(scene_.textures.end(), textures.begin(), textures.end());
  return first;
}

std::uint32_t SceneBuilder::default_material() {
  if (!default_material_) default_material_ = add_material(Material{});
  return *default_material_;
}

std::optional<std::uint32_t> SceneBuilder::add_shape(Shape shape, const JsonCursor& where) {
  if (!take(shape_bytes(shape), where)) return std::nullopt;
  if (primitive_count(shape) == 0) warn(where, "The mesh has no triangles, so nothing of it is seen.");
  const StrictFloats strict;  // images depend on the bounds
  scene_.shape_bounds.push_back(bounds(shape));
  shape_has_area_.push_back(proto::has_area(shape));
  scene_.shapes.push_back(std::move(shape));
  return static_cast<std::uint32_t>(scene_.shapes.size() - 1);
}

bool SceneBuilder::add_object(const Object& object, const JsonCursor& where) {
  if (scene_.objects.size() >= limits_.max_objects) {
    return where.error("The scene has more than " + std::to_string(limits_.max_objects) +
                       " objects with files and instances expanded; join small meshes, or place fewer instances.");
  }
  const std::uint64_t primitives = primitive_count(scene_.shapes[object.shape]);
  if (primitives > limits_.max_primitives - primitives_) {
    return where.error("The scene has more than " + std::to_string(limits_.max_primitives) +
                       " primitives with instances counted; place fewer of them.");
  }
  if (!stays_within_coordinates(object)) {
    return where.error("The transform takes the object beyond coordinates of 1e18; scale it down or move it nearer.");
  }
  if (!take(sizeof(Object), where)) return false;
  primitives_ += primitives;
  scene_.objects.push_back(object);
  return true;
}

bool SceneBuilder::has_area(std::uint32_t shape) const { return shape_has_area_[shape]; }

bool SceneBuilder::is_dark() const {
  const Features features = features_of(scene_);
  const bool shows_background = !features.only_whitted || features.reflection || features.refraction;
  const auto is_light_dark = [](const Light& light) {
    return std::visit([](const auto& l) { return proto::is_dark(l); }, light);
  };
  return !scene_.objects.empty() && !features.emitters && !features.unlit &&
         std::ranges::all_of(scene_.lights, is_light_dark) && (scene_.background.is_black() || !shows_background);
}

void SceneBuilder::warn(const JsonCursor& where, std::string detail) {
  if (scene_.warnings.size() >= kMaxWarnings) {
    ++warnings_left_out_;
  } else {
    scene_.warnings.push_back({where.document().pointer(where.index(), document_.index()), std::move(detail)});
  }
}

void SceneBuilder::warn(SceneWarning warning) {
  if (scene_.warnings.size() >= kMaxWarnings) {
    ++warnings_left_out_;
  } else {
    scene_.warnings.push_back(std::move(warning));
  }
}

void SceneBuilder::add_ground() {
  const StrictFloats strict;
  Aabb box;
  for (const Object& object : scene_.objects) box.extend(world_bounds(scene_, object));
  if (!box.empty()) scene_.ground = Ground{.height = box.lo.y};
}

Scene SceneBuilder::finish() && {
  if (warnings_left_out_ > 0) {
    scene_.warnings.push_back({"", "There are " + std::to_string(warnings_left_out_) + " more warnings."});
  }
  drop_unplaced_shapes(scene_);
  return std::move(scene_);
}

bool SceneBuilder::take(std::uint64_t bytes, const JsonCursor& where) {
  if (bytes > bytes_left()) {
    return where.error("The scene takes more than " + std::to_string(limits_.max_scene_bytes) +
                       " bytes of memory from here on; use smaller meshes, or instances of one mesh.");
  }
  bytes_ += bytes;
  return true;
}

bool SceneBuilder::stays_within_coordinates(const Object& object) const {
  const Aabb& local = scene_.shape_bounds[object.shape];
  if (!object.placement || local.empty()) return true;
  const Transform::ToWorld to_world = object.placement->to_world();
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p = to_world.point({corner & 1 ? local.hi.x : local.lo.x,  //
                                    corner & 2 ? local.hi.y : local.lo.y, corner & 4 ? local.hi.z : local.lo.z});
    if (!(max_component(abs(p)) <= kLargestCoordinate)) return false;
  }
  return true;
}

}  // namespace tessera::proto
