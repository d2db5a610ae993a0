#include "core/scene/light.h"

#include <algorithm>

namespace tessera {

bool is_black(const EnvironmentLight& light) {
  return light.radiance.is_black() || (light.map && std::ranges::all_of(light.map->texels, &Rgb::is_black));
}

}  // namespace tessera
