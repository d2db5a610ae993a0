#include "core/material/ggx_albedo.h"

#include <algorithm>
#include <cstddef>

#include "core/material/ggx_albedo_tables.h"

namespace tessera {
namespace {

/// Between the numbers `index` and `index` + 1 of a table.
struct Place {
  std::size_t index;
  float next;  ///< The weight of the later one.
};

Place place(float share, std::size_t size) {
  const auto last = static_cast<float>(size - 1);
  const float at = std::clamp(share, 0.0F, 1.0F) * last;
  const std::size_t index = std::min(static_cast<std::size_t>(at), size - 2);
  return {index, at - static_cast<float>(index)};
}

float between(float a, float b, float weight) { return a + (b - a) * weight; }

float look_up(const AlbedoSlice& slice, Place roughness, Place cosine) {
  const auto at = [&](std::size_t r) {
    return between(slice[r][cosine.index], slice[r][cosine.index + 1], cosine.next);
  };
  return between(at(roughness.index), at(roughness.index + 1), roughness.next) / kTableOne;
}

Place place_roughness(float roughness) { return place(table_roughness(roughness), kTableRoughnesses); }
Place place_cosine(float cos_theta, float roughness) {
  return place(table_cosine(cos_theta, roughness), kTableCosines);
}

}  // namespace

GgxAlbedo ggx_albedo(float cos_theta, float roughness) {
  const Place r = place_roughness(roughness);
  return {look_up(kWhiteAlbedo, r, place_cosine(cos_theta, roughness)),
          look_up(kSchlickAlbedo, r, place(schlick_table_cosine(cos_theta), kTableCosines))};
}

float dielectric_albedo(float cos_theta, float roughness, float eta) {
  const Place r = place_roughness(roughness), c = place_cosine(cos_theta, roughness);
  const Place e = place(table_eta(eta), kTableEtas);
  const auto& slices = kDielectricAlbedo[eta > 1 ? 1 : 0];
  return between(look_up(slices[e.index], r, c), look_up(slices[e.index + 1], r, c), e.next);
}

}  // namespace tessera
