#include "proto/names.h"

#include <vector>

#include "core/film/aov_table.h"

namespace tessera::proto {

std::span<const Choice<ScreenBounds>> screen_bounds_names() {
  static constexpr Choice<ScreenBounds> table[] = {
      {"off", ScreenBounds::off}, {"flat", ScreenBounds::flat}, {"hierarchical", ScreenBounds::hierarchical}};
  return table;
}

std::span<const Choice<Aov>> aov_names() {
  static const std::vector<Choice<Aov>> table = [] {
    std::vector<Choice<Aov>> names;
    for (const AovEntry& row : aov_table()) names.push_back({row.name, row.aov});
    return names;
  }();
  return table;
}

std::span<const Choice<IntegratorKind>> integrator_names() {
  static constexpr Choice<IntegratorKind> table[] = {
      {"auto", IntegratorKind::automatic}, {"whitted", IntegratorKind::whitted},
      {"direct", IntegratorKind::direct},  {"ambient_occlusion", IntegratorKind::ambient_occlusion},
      {"path", IntegratorKind::path},      {"none", IntegratorKind::none}};
  return table;
}

std::span<const Choice<SamplerKind>> sampler_names() {
  static constexpr Choice<SamplerKind> table[] = {{"auto", SamplerKind::automatic},
                                                  {"grid", SamplerKind::grid},
                                                  {"independent", SamplerKind::independent},
                                                  {"sobol", SamplerKind::sobol}};
  return table;
}

std::span<const Choice<FilterKind>> filter_names() {
  static constexpr Choice<FilterKind> table[] = {
      {"box", FilterKind::box}, {"gaussian", FilterKind::gaussian}, {"blackman_harris", FilterKind::blackman_harris}};
  return table;
}

}  // namespace tessera::proto
