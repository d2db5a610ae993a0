#include "core/accel/accel.h"

#include <cmath>

namespace tessera {

void Accel::closest(std::span<const Ray> rays, std::span<Hit> hits, TraceLog log, Candidates among) const {
  for (std::size_t i = 0; i < rays.size(); ++i)
    hits[i] = (among ? closest_among(rays[i], *among, log) : closest(rays[i], log)).value_or(Hit{});
}

void Accel::occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const {
  for (std::size_t i = 0; i < rays.size(); ++i) hidden[i] = occluded(rays[i], log);
}

void Accel::closest_fan(const RayFan& fan, std::span<Hit> hits, TraceLog log, Candidates among) const {
  for (std::size_t i = 0; i < fan.size(); ++i) {
    const Ray ray = fan.ray(i);
    hits[i] = (among ? closest_among(ray, *among, log) : closest(ray, log)).value_or(Hit{});
  }
}

void Accel::occluded_fan(Vec3, std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const {
  occluded(rays, hidden, log);
}

Ray only_at(const Ray& ray, float t) {
  Ray at = ray;
  at.t_min = std::nextafter(t, -kInfinity);
  at.t_max = std::nextafter(t, kInfinity);
  return at;
}

}  // namespace tessera
