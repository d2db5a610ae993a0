#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/material/sheen.h"

namespace tessera {

// The table behind `sheen_albedo`, by roughness, then by angle, in units of 1 / kSheenTableOne, and where its numbers
// stand. tests/unit/core/material/sheen_test.cpp integrates what it holds, and prints it (Sheen.DISABLED_PrintTable).

inline constexpr std::size_t kSheenCosines = 24, kSheenRoughnesses = 16;
inline constexpr float kSheenTableOne = 3333;

extern const std::array<std::array<std::uint16_t, kSheenCosines>, kSheenRoughnesses> kSheenAlbedo;

/// Places in it, as a share of its length: closest where most changes, along the horizon and for the least roughness.
inline float sheen_table_cosine(float cos_theta) { return std::sqrt(std::sqrt(cos_theta)); }
inline float sheen_table_roughness(float roughness) {
  return std::sqrt((roughness - kLeastSheenRoughness) / (1 - kLeastSheenRoughness));
}

}  // namespace tessera
