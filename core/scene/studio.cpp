#include "core/scene/studio.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/math/float_environment.h"
#include "core/math/portable_float.h"

namespace tessera {
namespace {

constexpr std::uint32_t kWidth = 256, kHeight = 128;
constexpr float kTurn = 2 * std::numbers::pi_v<float>;

/// A panel that shines: where its middle is and how far it reaches, in turns of 360°. Azimuths go from the front to the
/// right.
struct SoftBox {
  float azimuth, elevation, half_width, half_height, radiance;
};

constexpr SoftBox kBoxes[] = {
    {0.11F, 0.11F, 0.075F, 0.055F, 4.6F},  // key, from the front, right and above
    {-0.17F, 0.05F, 0.06F, 0.08F, 1.1F},   // fill
    {0.40F, 0.07F, 0.04F, 0.08F, 1.8F},    // rims
    {-0.39F, 0.08F, 0.035F, 0.08F, 2.2F},
};
constexpr float kCeilingFrom = 0.2F, kCeiling = 1.2F;

/// 1 inside of `half`, 0 outside, with an edge that is a tenth of a box wide.
float inside(float distance, float half) {
  const float x = std::clamp((half - distance) / (0.2F * half) + 0.5F, 0.0F, 1.0F);
  return x * x * (3 - 2 * x);
}

float room(float elevation) {
  constexpr float kFloor = 0.3F, kWall = 0.38F;
  const float up = std::clamp(elevation * 4 + 0.5F, 0.0F, 1.0F);
  return kFloor + (kWall - kFloor) * up * up * (3 - 2 * up);
}

float radiance(float azimuth, float elevation) {
  float sum = room(elevation);
  for (const SoftBox& box : kBoxes) {
    float across = std::abs(azimuth - box.azimuth);
    across = std::min(across, 1 - across) * portable_sin_cos(elevation * kTurn).cos;
    sum += box.radiance * inside(across, box.half_width) * inside(std::abs(elevation - box.elevation), box.half_height);
  }
  return sum + kCeiling * inside(0.25F - elevation, 0.25F - kCeilingFrom);
}

EnvironmentMap make() {
  const StrictFloats strict;
  EnvironmentMap map{kWidth, kHeight, {}};
  for (std::uint32_t y = 0; y < kHeight; ++y)
    for (std::uint32_t x = 0; x < kWidth; ++x) {
      // The picture's middle is -z, what lies right of it +x: so the front, +z, is at its edges, and its right at 3/4.
      const float around = (static_cast<float>(x) + 0.5F) / kWidth;
      const float azimuth = around < 0.5F ? -around : 1 - around;
      const float elevation = 0.25F - (static_cast<float>(y) + 0.5F) / kHeight / 2;
      const float value = radiance(azimuth, elevation);
      map.texels.push_back({value, value, value});
    }
  return map;
}

}  // namespace

std::shared_ptr<const EnvironmentMap> studio_environment() {
  static const auto map = std::make_shared<const EnvironmentMap>(make());
  return map;
}

}  // namespace tessera
