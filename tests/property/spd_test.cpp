// Haines' standard scenes: his ray counts beside ours (STRESS 61).
#include <cstdio>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/image.h"
#include "tests/support/imported_scene.h"
#include "tests/support/shared_data.h"

namespace tessera {
namespace {

TEST(Spd, RayCountsAreHainesWithinTenPercent_Stress61) {
  const auto data = shared_data();
  if (!data) GTEST_SKIP() << "the SPD scenes are not beside this checkout (shared/data/spd-nff)";
  const auto table = nlohmann::json::parse(std::ifstream(*data / "spd-nff/expected_stats.json"));
  std::printf("%-11s %-8s %10s %10s %8s\n", "scene", "rays", "Haines", "ours", "off by");
  for (const auto& [name, haines] : table["scenes"].items()) {
    const auto scene = imported_scene(*data / "spd-nff" / (name + ".nff"));
    ASSERT_TRUE(scene) << name;
    Settings settings;  // 513 × 513 rays through the corners of 512 × 512 pixels, to depth 5
    settings.width = settings.height = 513;
    settings.jitter = false;
    const RayCounts rays = render_image(scene, *scene->camera, settings, 2).rays;
    const auto compare = [&, &scene_name = name](const char* kind, std::uint64_t ours) {
      const auto his = haines[kind].get<double>();
      const double off = his == 0 ? static_cast<double>(ours) : 100 * (static_cast<double>(ours) / his - 1);
      std::printf("%-11s %-8s %10.0f %10llu %+7.2f%%\n", scene_name.c_str(), kind, his,
                  static_cast<unsigned long long>(ours), off);
      EXPECT_LE(std::abs(off), 10) << scene_name << " " << kind;
    };
    compare("eye_hit", rays.camera_hits);
    compare("reflect", rays.reflection);
    compare("refract", rays.refraction);
    compare("shadow", rays.shadow);
  }
}

}  // namespace
}  // namespace tessera
