#include "core/plan/plan.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <variant>

#include "core/math/float_environment.h"

namespace tessera {
namespace {

std::uint64_t count_primitives(const Scene& scene) {
  std::uint64_t sum = 0;
  for (const Object& object : scene.objects) sum += primitive_count(scene.shapes[object.shape]);
  return sum;
}

std::uint64_t pixels_of(const Tiling& tiling, FirstLevel level) {
  std::uint64_t sum = 0;
  for (const Tile& tile : tiling.tiles)
    if (tile.first_level == level) sum += static_cast<std::uint64_t>(tile.rect.area());
  return sum;
}

constexpr std::uint32_t kWhittedDepth = 5, kPathDepth = 16;

void choose_integrator(Plan& plan, const Settings& settings) {
  plan.integrator = chosen_integrator(settings.integrator, plan.features);
  plan.integrator_because = "the job asks for it";
  if (settings.integrator == IntegratorKind::automatic) {
    plan.integrator_because = plan.features.only_whitted
                                  ? "the scene has nothing but Whitted's materials and lights"
                                  : "the scene has materials or lights that Whitted's ray tracer doesn't know";
  }
  const bool whitted = plan.integrator == IntegratorKind::whitted;
  plan.sampler = settings.sampler;
  if (settings.sampler == SamplerKind::automatic)
    plan.sampler = whitted && !measures_error(settings) ? SamplerKind::grid : SamplerKind::sobol;
  plan.max_depth = settings.max_depth.value_or(whitted ? kWhittedDepth : kPathDepth);
  if (plan.integrator == IntegratorKind::direct) plan.max_depth = std::min(plan.max_depth, kDirectDepth);
}

/// A path of a few surfaces, with a ray to a light at each.
constexpr double kRaysOfAPath = 6;

/// Rays that the job will come to, guessed from what its plan leaves to be traced and from what materials and lights
/// make of a hit: of ten camera rays seven hit, and each kind of secondary ray adds the better part of the first ones.
double expected_rays(const Plan& plan, const Scene& scene, const Settings& settings) {
  double pixels = 0;
  for (const Tile& tile : plan.tiling.tiles)
    if (tile.first_level != FirstLevel::nothing) pixels += static_cast<double>(tile.rect.area());
  if (plan.integrator == IntegratorKind::none) return pixels * settings.samples;
  if (plan.integrator != IntegratorKind::whitted) return pixels * settings.samples * kRaysOfAPath;
  double chain = 1;
  if (plan.max_depth > 1) {
    if (plan.features.reflection) chain += 0.6;
    if (plan.features.refraction) chain += 0.9;
  }
  const auto casting = static_cast<double>(std::ranges::count_if(
      scene.lights, [](const Light& light) { return !std::holds_alternative<AmbientLight>(light); }));
  return pixels * settings.samples * chain * (1 + 0.7 * casting);
}

std::string in_milliseconds(double seconds) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g ms", seconds * 1e3);
  return text.data();
}

/// The estimates are off by a fifth here and there, so something else has to promise this share of what the wide
/// hierarchy of boxes costs: that one is led astray least by how a scene is made. By `tests/bench
/// structures` jobs take 0.33 to 0.69 times as long as with the binary one, 0.87 to 1.05 times where there is no mesh.
constexpr double kClearly = 0.8;

void choose_accel(Plan& plan, const Scene& scene, const Settings& settings) {
  const double rays = expected_rays(plan, scene, settings);
  plan.candidates = estimate_accels(scene, rays);
  plan.accel = settings.accel;
  plan.accel_because = "the job asks for it";
  if (settings.accel.kind != AccelKind::automatic) return;
  const auto tree =
      std::ranges::find(plan.candidates, AccelKind::wide, [](const AccelEstimate& e) { return e.options.kind; });
  const AccelEstimate& best = plan.candidates[0];
  // Testing a handful of primitives one by one is the one cost that nothing can lead astray.
  const double share = best.options.kind == AccelKind::brute ? 1 : kClearly;
  const bool is_clear = best.total_seconds() < share * tree->total_seconds();
  const AccelEstimate& chosen = is_clear ? best : *tree;
  plan.accel = chosen.options;
  plan.accel_because = "for " + std::to_string(plan.primitives) + " primitives and about " +
                       std::to_string(static_cast<std::uint64_t>(rays)) +
                       " rays, predicted: " + in_milliseconds(chosen.build_seconds) + " to build and " +
                       in_milliseconds(chosen.trace_seconds) + " to trace; ";
  plan.accel_because += is_clear ? "wide would take " + in_milliseconds(tree->total_seconds())
                                 : "nothing promises clearly less than wide";
}

/// Meshes that are left alone until a ray comes to them: all but one that is all there is.
std::uint64_t meshes_on_demand(const Plan& plan, const Scene& scene) {
  if (plan.accel.kind != AccelKind::wide || (scene.objects.size() == 1 && !scene.objects[0].placement)) return 0;
  return static_cast<std::uint64_t>(std::ranges::count_if(
      scene.shapes, [](const Shape& shape) { return std::holds_alternative<TriangleMesh>(shape); }));
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
  skip("meshes", meshes_on_demand(plan, scene),
       "meshes that may be left out: each is built when a ray enters the box of one of its objects, and never if none "
       "does");
  const auto skip_feature = [&](const char* what, bool is_needed, const char* because) {
    skip(what, is_needed ? 0 : 1, because);
  };
  const Features& has = plan.features;
  if (plan.integrator == IntegratorKind::whitted) {
    skip_feature("shadow_rays", has.shadows, "the feature: no light casts shadows");
    skip_feature("reflection_rays", has.reflection, "the feature: no material in use reflects");
    skip_feature("refraction_rays", has.refraction, "the feature: no material in use transmits");
  }
  if (traces_paths(plan.integrator)) {
    skip_feature("light_samples", has.lights > 0 && has.rough_surfaces,
                 has.lights > 0 ? "the feature: all surfaces are smooth, so that no light is sampled"
                                : "the feature: there is no light to sample");
    skip_feature("light_hierarchy", has.lights != 1,
                 "the feature: one light is all there is, so none has to be picked");
    skip_feature("last_segments", has.emitters || has.sky || has.unlit,
                 "the feature: no ray can meet a light by chance");
    skip_feature("transmission", has.transmission,
                 "the feature: no surface scatters light to its far side, so none is lit from behind");
    skip_feature("alpha", has.alpha, "the feature: all surfaces are opaque");
    skip_feature("sky", !has.even_sky, "the feature: the sky is alike all over, so what sees it alone takes no ray");
  }
}

}  // namespace

bool needs_structure(const Plan& plan) {
  if (plan.features.ground && traces_paths(plan.integrator)) return true;
  return std::ranges::any_of(plan.tiling.tiles, [](const Tile& t) { return t.first_level != FirstLevel::nothing; });
}

bool needs_lights(const Plan& plan) {
  const Features& has = plan.features;
  const bool looks = needs_structure(plan) || !has.even_sky;
  return traces_paths(plan.integrator) && looks && (has.lights > 0 || has.emitters || has.sky);
}

Plan make_plan(const Scene& scene, const Camera& camera, const Settings& settings) {
  const StrictFloats strict;
  Plan plan;
  plan.primitives = count_primitives(scene);
  plan.tiling = make_tiling(scene, camera, settings);
  plan.features = features_of(scene);
  choose_integrator(plan, settings);
  choose_accel(plan, scene, settings);
  list_skips(plan, scene, settings);
  return plan;
}

}  // namespace tessera
