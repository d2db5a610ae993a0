#include "proto/names.h"

namespace tessera::proto {

std::span<const Choice<ScreenBounds>> screen_bounds_names() {
  static constexpr Choice<ScreenBounds> table[] = {
      {"off", ScreenBounds::off}, {"flat", ScreenBounds::flat}, {"hierarchical", ScreenBounds::hierarchical}};
  return table;
}

std::span<const Choice<Aov>> aov_names() {
  static constexpr Choice<Aov> table[] = {{"depth", Aov::depth},
                                          {"normal", Aov::normal},
                                          {"primitive_id", Aov::primitive_id},
                                          {"object_id", Aov::object_id},
                                          {"cost_volumes", Aov::cost_volumes},
                                          {"cost_primitives", Aov::cost_primitives}};
  return table;
}

}  // namespace tessera::proto
