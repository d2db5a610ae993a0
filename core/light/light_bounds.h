#pragma once

#include "core/bounds/aabb.h"
#include "core/math/vec.h"

namespace tessera {

/// Where a light is and which way it shines, as far as picking among many needs to know: its axis lies within a spread
/// of `axis`, and it emits up to a reach away from that, about in proportion to the cosine.
struct LightBounds {
  Aabb box;
  Vec3 axis{0, 0, 1};     ///< Unit.
  float cos_spread = -1;  ///< −1: it may point anywhere.
  float cos_reach = 0;
  bool both_sides = false;  ///< It emits along the opposite of its axis too.
  double intensity = 0;     ///< W/sr along its axis; finite.
};

/// Which ways several lights shine (Conty Estevez & Kulla 2018, sect. 4.1): as `LightBounds`, for them all.
struct EmissionCone {
  Vec3d axis{0, 0, 1};  ///< Unit.
  double cos_spread = -1, cos_reach = 1;
  bool both_sides = false;

  /// Holds nothing but a direction, of any length; all directions where that is 0.
  static EmissionCone around(Vec3d direction);

  /// Grows to hold one more; the axis stays.
  void extend(const LightBounds& light);

  /// The directions that it sends light to, weighed with the cosine: from π for a flat light to 4π (sect. 4.2).
  double measure() const;
};

/// Holds both, with the narrowest spread that there is.
EmissionCone united(const EmissionCone& a, const EmissionCone& b);

}  // namespace tessera
