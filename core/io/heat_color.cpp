#include "core/io/heat_color.h"

#include <algorithm>

namespace tessera {
namespace {

// L* = 0, 12.5, ... 100; between them the ramp is straight in sRGB, which bends L* by less than 2.
constexpr std::array<std::array<double, 3>, 9> kStops{{{0, 0, 0},
                                                       {48, 20, 61},
                                                       {100, 29, 93},
                                                       {156, 43, 105},
                                                       {205, 71, 102},
                                                       {239, 113, 97},
                                                       {255, 162, 115},
                                                       {254, 212, 170},
                                                       {255, 255, 255}}};

}  // namespace

std::array<std::uint8_t, 3> heat_color(double v) {
  const double at = (v > 0 ? std::min(v, 1.0) : 0.0) * (kStops.size() - 1);
  const auto stop = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double beyond = at - static_cast<double>(stop);
  std::array<std::uint8_t, 3> color{};
  for (std::size_t i = 0; i < 3; ++i)
    color[i] = static_cast<std::uint8_t>(kStops[stop][i] + beyond * (kStops[stop + 1][i] - kStops[stop][i]) + 0.5);
  return color;
}

}  // namespace tessera
