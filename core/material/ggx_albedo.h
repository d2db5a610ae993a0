#pragma once

namespace tessera {

// What single scattering at a rough surface (GGX as in ggx.h) keeps of even light, from tables: to give back the rest
// (Turquin 2019). `cos_theta` is of wo, > 0; `roughness` in [kLeastRoughness, 1].

/// Of facets that reflect all.
struct GgxAlbedo {
  float white;         ///< The share that is reflected.
  float schlick_mean;  ///< The mean of Schlick's (1 - cos)^5 over what is reflected; cos is of half the angle between.
};
GgxAlbedo ggx_albedo(float cos_theta, float roughness);

/// The share that a dielectric reflects or lets pass, by the index of the far side relative to the near one, `eta` > 0.
float dielectric_albedo(float cos_theta, float roughness, float eta);

}  // namespace tessera
