#pragma once

#include "core/math/rgb.h"

namespace tessera {

/// Whitted's surface (1980) with Phong's highlight. With E the light's irradiance on a plane that faces it, a
/// light adds E/π · (diffuse · cos θ + specular · cos^shininess α), α between the mirrored view direction and the
/// light: classic Phong, as NFF means it, so diffuse + specular may exceed 1. `reflect` and `transmit` weigh the
/// radiance that mirror and refraction rays bring back; black means that no such ray is traced.
struct Material {
  Rgb diffuse{0.5F, 0.5F, 0.5F};
  Rgb specular{};
  float shininess = 1;  ///< ≥ 0
  Rgb reflect{};
  Rgb transmit{};
  float ior = 1;         ///< Index of refraction inside, relative to outside; > 0.
  bool fresnel = false;  ///< Split reflect and transmit by Fresnel's equations for dielectrics.
};

}  // namespace tessera
