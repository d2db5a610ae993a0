#include "core/plan/plan.h"

#include <algorithm>
#include <variant>

#include "core/math/float_environment.h"

namespace tessera {
namespace {

std::uint64_t count_primitives(const Scene& scene) {
  std::uint64_t sum = 0;
  for (const Object& object : scene.objects) sum += primitive_count(scene.shapes[object.shape]);
  return sum;
}

void choose_accel(Plan& plan, const Settings& settings) {
  plan.accel = settings.accel;
  if (settings.accel.kind != AccelKind::automatic) {
    plan.accel_because = "the job asks for it";
  } else if (plan.primitives <= kFewPrimitives) {
    plan.accel.kind = AccelKind::brute;
    plan.accel_because = "testing " + std::to_string(plan.primitives) + " primitives costs less than walking a tree";
  } else {
    plan.accel.kind = AccelKind::bvh;
    plan.accel_because = std::to_string(plan.primitives) + " primitives: a hierarchy pays for itself";
  }
}

std::uint64_t pixels_of(const Tiling& tiling, FirstLevel level) {
  std::uint64_t sum = 0;
  for (const Tile& tile : tiling.tiles)
    if (tile.first_level == level) sum += static_cast<std::uint64_t>(tile.rect.area());
  return sum;
}

template <typename Used>
bool any_material(const Scene& scene, Used&& used) {
  return std::ranges::any_of(scene.objects, [&](const Object& o) { return used(scene.materials[o.material]); });
}

void list_skips(Plan& plan, const Scene& scene, const Settings& settings) {
  const auto skip = [&](const char* what, std::uint64_t count, const char* because) {
    if (count > 0) plan.skips.push_back({what, because, count});
  };
  const auto empty_tiles =
      static_cast<std::uint64_t>(std::ranges::count(plan.tiling.tiles, FirstLevel::nothing, &Tile::first_level));
  skip("tiles", empty_tiles, "tiles into which no object projects: background without a ray");
  skip("camera_rays", pixels_of(plan.tiling, FirstLevel::nothing) * settings.samples, "camera rays of those tiles");
  skip("objects", scene.objects.size() - plan.tiling.objects_on_screen,
       "objects off the screen: no first-level ray tests them where a tile has a list of its own");
  skip("structure", needs_structure(plan) ? 0 : 1, "nothing projects onto the screen: no structure is built");
  const bool casts_shadows = std::ranges::any_of(
      scene.lights, [](const Light& light) { return !std::holds_alternative<AmbientLight>(light); });
  skip("shadow_rays", casts_shadows ? 0 : 1, "the feature: no light casts shadows");
  skip("reflection_rays", any_material(scene, [](const Material& m) { return !m.reflect.is_black(); }) ? 0 : 1,
       "the feature: no material in use reflects");
  skip("refraction_rays", any_material(scene, [](const Material& m) { return !m.transmit.is_black(); }) ? 0 : 1,
       "the feature: no material in use transmits");
}

}  // namespace

bool needs_structure(const Plan& plan) {
  return std::ranges::any_of(plan.tiling.tiles, [](const Tile& t) { return t.first_level != FirstLevel::nothing; });
}

Plan make_plan(const Scene& scene, const Camera& camera, const Settings& settings) {
  const StrictFloats strict;
  Plan plan;
  plan.primitives = count_primitives(scene);
  choose_accel(plan, settings);
  Settings chosen = settings;
  chosen.accel = plan.accel;
  plan.tiling = make_tiling(scene, CameraRays(camera, settings.width, settings.height), chosen);
  list_skips(plan, scene, settings);
  return plan;
}

}  // namespace tessera
