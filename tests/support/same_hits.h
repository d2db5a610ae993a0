#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/accel/accel.h"
#include "tests/support/accel_choices.h"

namespace tessera {

/// How GoogleTest tells hits.
inline void PrintTo(const Hit& hit, std::ostream* out) {
  *out << "t " << hit.t << ", object " << hit.object << ", primitive " << hit.primitive;
}

/// A ray and what brute force makes of it.
struct KnownRay {
  Ray ray;
  std::optional<Hit> hit;
};

/// What brute force finds; it is the one that every structure is held against.
inline std::vector<KnownRay> known_rays(const std::shared_ptr<const Scene>& scene, const std::vector<Ray>& rays) {
  const auto brute = make_accel(scene, {AccelKind::brute});
  std::vector<KnownRay> known;
  known.reserve(rays.size());
  for (const Ray& ray : rays) known.push_back({ray, brute->closest(ray)});
  return known;
}

inline std::size_t count_hits(const std::vector<KnownRay>& known) {
  return static_cast<std::size_t>(std::ranges::count_if(known, [](const KnownRay& k) { return k.hit.has_value(); }));
}

/// The same hit or miss, the same object and primitive, a bit-equal t. Stops at the first ray that differs.
inline void expect_same_hits(const Accel& accel, const std::vector<KnownRay>& known, const std::string& what) {
  for (std::size_t i = 0; i < known.size(); ++i) {
    ASSERT_EQ(accel.closest(known[i].ray), known[i].hit) << what << ", ray " << i;
    ASSERT_EQ(accel.occluded(known[i].ray), known[i].hit.has_value()) << what << ", ray " << i;
  }
}

/// The same in every structure × bound × space.
inline void expect_same_hits_everywhere(const std::shared_ptr<const Scene>& scene, const std::vector<KnownRay>& known,
                                        const std::string& what) {
  for (const AccelOptions& options : accel_choices())
    expect_same_hits(*make_accel(scene, options), known, describe(options) + ", " + what);
}

}  // namespace tessera
