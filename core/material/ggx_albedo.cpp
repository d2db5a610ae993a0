#include "core/material/ggx_albedo.h"

#include <algorithm>
#include <cstddef>

#include "core/material/ggx_albedo_tables.h"

namespace tessera {
namespace {

/// Where in a table, between 0 and 1, and how much the numbers there weigh. Along roughness and eta a parabola through
/// the three nearest, along the angle, where there are more of them, a line through two.
struct Parabola {
  std::size_t first;
  float weights[3];
};
struct Line {
  std::size_t first;
  float next;
};

Parabola parabola(float share, std::size_t size) {
  const float at = std::clamp(share, 0.0F, 1.0F) * static_cast<float>(size - 1);
  const std::size_t first = std::clamp(static_cast<std::size_t>(at + 0.5F), std::size_t{1}, size - 2) - 1;
  const float x = at - static_cast<float>(first + 1);
  return {first, {x * (x - 1) / 2, (1 - x) * (1 + x), x * (x + 1) / 2}};
}

Line line(float share, std::size_t size) {
  const float at = std::clamp(share, 0.0F, 1.0F) * static_cast<float>(size - 1);
  const std::size_t first = std::min(static_cast<std::size_t>(at), size - 2);
  return {first, at - static_cast<float>(first)};
}

/// A parabola may run past its numbers where they change fast; it isn't followed below the smallest or above 1.
float along(const Parabola& parabola, const float (&numbers)[3]) {
  const float sum =
      parabola.weights[0] * numbers[0] + parabola.weights[1] * numbers[1] + parabola.weights[2] * numbers[2];
  return std::clamp(sum, std::min({numbers[0], numbers[1], numbers[2]}), 1.0F);
}

float look_up(const AlbedoSlice& slice, const Parabola& roughness, Line cosine) {
  float numbers[3];
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& row = slice[roughness.first + i];
    const float a = row[cosine.first], b = row[cosine.first + 1];
    numbers[i] = (a + (b - a) * cosine.next) / kTableOne;
  }
  return along(roughness, numbers);
}

}  // namespace

GgxAlbedo ggx_albedo(float cos_theta, float roughness) {
  const Parabola r = parabola(table_roughness(roughness), kTableRoughnesses);
  return {look_up(kWhiteAlbedo, r, line(table_cosine(cos_theta, roughness), kTableCosines)),
          look_up(kSchlickMean, r, line(schlick_table_cosine(cos_theta), kTableCosines))};
}

float dielectric_albedo(float cos_theta, float roughness, float eta) {
  const Parabola r = parabola(table_roughness(roughness), kTableRoughnesses);
  const Line c = line(table_cosine(cos_theta, roughness), kTableCosines);
  const Parabola e = parabola(table_eta(eta), kTableEtas);
  const auto& slices = kDielectricAlbedo[eta > 1 ? 1 : 0];
  return along(
      e, {look_up(slices[e.first], r, c), look_up(slices[e.first + 1], r, c), look_up(slices[e.first + 2], r, c)});
}

}  // namespace tessera
