#pragma once

#include "core/math/rgb.h"
#include "core/math/vec.h"

namespace tessera {

/// What a BSDF is towards one direction. Black with density 0 where nothing but delta lobes goes.
struct BsdfValue {
  Rgb f_cos{};    ///< f · |cos θi|, 1/sr.
  float pdf = 0;  ///< With which `sample` chooses the direction, per solid angle.
};

/// A direction that was chosen at random.
struct BsdfSample {
  Vec3 wi{};
  Rgb weight{};   ///< f · |cos θi| / pdf.
  float pdf = 0;  ///< Per solid angle; of a delta lobe, the probability of having been chosen.
  bool is_delta = false;
  bool transmits = false;
  float eta_scale =
      1;  ///< Weight · eta_scale is without the scaling of radiance by 1/eta²: what Russian roulette sees.
};

}  // namespace tessera
