#include "core/scene/material.h"

namespace tessera {

std::optional<WhittedSurface> whitted_surface(const Surface& surface) {
  if (const auto* whitted = std::get_if<WhittedSurface>(&surface)) return *whitted;
  if (const auto* diffuse = std::get_if<Diffuse>(&surface)) return WhittedSurface{.diffuse = diffuse->color};
  if (const auto* glass = std::get_if<Dielectric>(&surface); glass && glass->roughness == 0)
    return WhittedSurface{
        .diffuse = {}, .reflect = {1, 1, 1}, .transmit = glass->color, .ior = glass->ior, .fresnel = true};
  return std::nullopt;
}

}  // namespace tessera
