#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/math/ray.h"

namespace tessera {

/// Directions, coordinate by coordinate: as many as fit into a register are read at once.
struct Directions {
  std::vector<float> x, y, z;  ///< Of one length.

  void clear() {
    x.clear();
    y.clear();
    z.clear();
  }
  void push_back(Vec3 direction) {
    x.push_back(direction.x);
    y.push_back(direction.y);
    z.push_back(direction.z);
  }
  void append_those_of(std::span<const Ray> rays) {
    for (const Ray& ray : rays) push_back(ray.direction);
  }
};

/// A view of rays that leave one point, all with the same interval: a camera's.
struct RayFan {
  Vec3 origin;
  std::span<const float> x, y, z;  ///< Directions; of one length.
  float t_min = 0, t_max = kInfinity;

  RayFan(Vec3 from, std::span<const float> dx, std::span<const float> dy, std::span<const float> dz)
      : origin(from), x(dx), y(dy), z(dz) {}
  RayFan(Vec3 from, const Directions& directions) : RayFan(from, directions.x, directions.y, directions.z) {}

  std::size_t size() const { return x.size(); }
  Ray ray(std::size_t i) const { return {origin, {x[i], y[i], z[i]}, t_min, t_max}; }
  RayFan part(std::size_t first, std::size_t count) const {
    RayFan some = *this;
    some.x = x.subspan(first, count);
    some.y = y.subspan(first, count);
    some.z = z.subspan(first, count);
    return some;
  }
};

/// A view of rays in whichever form they are: any, or a fan's.
class RaySpan {
 public:
  RaySpan(std::span<const Ray> rays) : rays_(rays) {}
  RaySpan(const std::vector<Ray>& rays) : rays_(rays) {}
  RaySpan(const RayFan& fan) : fan_(fan) {}

  std::size_t size() const { return fan_ ? fan_->size() : rays_.size(); }
  Ray operator[](std::size_t i) const { return fan_ ? fan_->ray(i) : rays_[i]; }

 private:
  std::span<const Ray> rays_;
  std::optional<RayFan> fan_;
};

}  // namespace tessera
