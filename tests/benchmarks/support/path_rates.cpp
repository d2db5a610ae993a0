#include "tests/benchmarks/support/path_rates.h"

#include <cstdio>
#include <map>
#include <stdexcept>

#include "core/plan/plan.h"
#include "proto/parse.h"
#include "tests/benchmarks/support/kernel_race.h"
#include "tests/support/files_beside.h"

namespace tessera::bench {
namespace {

constexpr int kRepetitions = 3;
constexpr std::uint32_t kKernelSide = 512, kSamples = 64;

/// A light for the shadow rays: beside the camera, as every point that it sees can be lit from there.
KernelScene kernel_scene_of(const LightScene& scene, const std::filesystem::path& folder) {
  const auto parsed = proto::parse_scene(scene.document.dump(), FilesBeside(folder), proto::Limits());
  if (!parsed) throw std::runtime_error(scene.name + " is refused: " + parsed.problem().detail);
  const Camera camera = *parsed->scene->camera;
  const View& view = std::get<PerspectiveCamera>(camera).view;
  const Vec3 up = view.up * (0.2F * length(view.at - view.from) / length(view.up));
  return {scene.name, parsed->scene, camera, view.from + up};
}

std::map<std::string, double> kernel_mrays(const KernelScene& scene) {
  Settings settings;
  settings.width = settings.height = kKernelSide;
  const auto accel = make_accel(scene.scene, make_plan(*scene.scene, scene.camera, settings).accel);
  std::map<std::string, double> mrays;
  for (const RaySet& set : kernel_rays(scene, *accel, kKernelSide))
    if (set.name == "first_level" || set.name == "diffuse" || set.name == "shadow")
      mrays[set.name] = race(*accel, {}, set, {kRepetitions, {1}}).mrays[0].median();
  return mrays;
}

}  // namespace

void measure_path_rates(Report& report, const LightScene& scene, const std::filesystem::path& folder,
                        Tessera& one_thread) {
  const auto kernel = kernel_mrays(kernel_scene_of(scene, folder));
  one_thread.render(scene, {{"samples", 1}});  // builds the structure
  Samples path, share;
  double alone = 0;
  for (int i = 0; i < kRepetitions; ++i) {
    nlohmann::json stats;
    const double seconds = one_thread.render(scene, {{"samples", kSamples}, {"seed", i}}, &stats).seconds;
    const auto& rays = stats.at("rays");
    const double total = rays.at("total"), camera = rays.at("camera"), shadow = rays.at("shadow");
    const double tracing = 1e-6 * (camera / kernel.at("first_level") + shadow / kernel.at("shadow") +
                                   (total - camera - shadow) / kernel.at("diffuse"));
    path.add(1e-6 * total / seconds);
    share.add(tracing / seconds);
    alone = 1e-6 * total / tracing;
  }
  print_table({{"one thread, Mray/s", "path", "its rays alone", "path / alone", "first level", "diffuse", "shadow"},
               {scene.name, with_spread(path), three_digits(alone), with_spread(share, 2),
                three_digits(kernel.at("first_level")), three_digits(kernel.at("diffuse")),
                three_digits(kernel.at("shadow"))}});
  report.figures()["path_rates"][scene.name] = {
      {"path_mrays", path.to_json()}, {"kernel_mrays", kernel}, {"share", share.to_json()}};
  report.at_least("convergence/path_mrays_over_kernels/" + scene.name, share.median(), 0.7);
}

}  // namespace tessera::bench
