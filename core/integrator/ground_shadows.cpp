#include "core/integrator/ground_shadows.h"

#include <cmath>

#include "core/sampling/warp.h"

namespace tessera {
namespace {

/// Rays to the sky from each point: shadows are all that is seen there, and little noise is seen most.
constexpr std::uint32_t kRays = 4;

float below_one(float x) { return x < 1 ? x : x - 1; }

}  // namespace

bool GroundShadows::add(const Ray& ray, Vec2 numbers, Rgb background, float passed, std::uint32_t sum) {
  const float height = scene_.ground->height;
  const double t = (double{height} - ray.origin.y) / ray.direction.y;
  if (!(ray.direction.y < 0 && t > 0 && t < ray.t_max)) return false;
  const Vec3 at{static_cast<float>(ray.origin.x + t * ray.direction.x), height,
                static_cast<float>(ray.origin.z + t * ray.direction.z)};
  const auto index = static_cast<std::uint32_t>(shadows_.size());
  for (std::uint32_t i = 0; i < kRays; ++i) {
    // Halves of the square, and halves of these.
    const Vec2 u{below_one(numbers.x + static_cast<float>(i % 2) / 2),
                 below_one(numbers.y + static_cast<float>(i / 2) / 2)};
    const Vec3 way = cosine_hemisphere(u);
    batch_.add({at, {way.x, way.z, way.y}}, Rgb{1, 1, 1} * (1.0F / kRays), index);
  }
  shadows_.push_back({background, passed, sum});
  return true;
}

void GroundShadows::trace(const Accel& accel, Integrator::Output out, RayCounts& counts, TraceLog log) {
  open_.assign(shadows_.size(), Rgb{});
  batch_.trace(accel, open_, counts, log);
  for (std::size_t i = 0; i < shadows_.size(); ++i) {
    const auto& [background, passed, sum] = shadows_[i];
    const float seen = 1 - scene_.ground->darkness * (1 - open_[i].g);
    out.radiance[sum] = out.radiance[sum] + background * seen;
    out.covered[sum] = 1 - passed * seen;
  }
  shadows_.clear();
}

}  // namespace tessera
