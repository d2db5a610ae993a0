#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/material/ggx.h"

namespace tessera {

// The tables behind ggx_albedo.h, and where their numbers stand. tests/unit/core/material/ggx_albedo_test.cpp
// integrates what they hold, and prints the file that defines them (GgxAlbedo.DISABLED_PrintTables).

inline constexpr std::size_t kTableCosines = 24, kTableRoughnesses = 16, kTableEtas = 18;

/// For one kind of facet: by roughness, then by angle, in units of 1 / kTableOne.
using AlbedoSlice = std::array<std::array<std::uint16_t, kTableCosines>, kTableRoughnesses>;
inline constexpr float kTableOne = 9999;

extern const AlbedoSlice kWhiteAlbedo, kSchlickMean;
/// From an eta of 1 to the largest; [0]: its inverse, light passes into the less dense medium.
extern const std::array<std::array<AlbedoSlice, kTableEtas>, 2> kDielectricAlbedo;

/// Places in a table, as a share of its length.
///
/// Of an angle: what shadows hide changes where cos θ is about alpha, so that place is at the middle;
inline float table_cosine(float cos_theta, float roughness) {
  const float alpha = ggx_alpha(roughness);
  return cos_theta * (1 + alpha) / (cos_theta + alpha);
}
/// but for Schlick's term: that changes with the angle itself, most close to the horizon.
inline float schlick_table_cosine(float cos_theta) { return std::sqrt(cos_theta); }
inline float table_roughness(float roughness) { return (roughness - kLeastRoughness) / (1 - kLeastRoughness); }
/// Of an eta (or its inverse): close to 1 little differences change much.
inline float table_eta(float eta) {
  constexpr float kLargest = 999.0F / 1001;  // of |eta - 1| / (eta + 1), at 1000
  return std::sqrt(std::sqrt(std::min(std::abs(eta - 1) / (eta + 1) / kLargest, 1.0F)));
}

}  // namespace tessera
