#include "core/scene/material.h"

#include <algorithm>

namespace tessera {

bool has_texture(const Material& material, TextureSlot slot) {
  return std::ranges::find(material.textures, slot, &TextureUse::slot) != material.textures.end();
}

bool alpha_varies(const Material& material) {
  return material.has_vertex_alpha || has_texture(material, TextureSlot::alpha);
}

bool has_alpha(const Material& material) { return material.alpha < 1 || alpha_varies(material); }

bool is_lamp(const Material& material) {
  return !material.emission.is_black() && material.alpha > 0 && !alpha_varies(material);
}

std::optional<WhittedSurface> whitted_surface(const Surface& surface) {
  if (const auto* whitted = std::get_if<WhittedSurface>(&surface)) return *whitted;
  if (const auto* diffuse = std::get_if<Diffuse>(&surface)) return WhittedSurface{.diffuse = diffuse->color};
  if (const auto* glass = std::get_if<Dielectric>(&surface); glass && glass->roughness == 0)
    return WhittedSurface{
        .diffuse = {}, .reflect = {1, 1, 1}, .transmit = glass->color, .ior = glass->ior, .fresnel = true};
  return std::nullopt;
}

Rgb base_color(const Surface& surface) {
  struct ColorOf {
    Rgb operator()(const WhittedSurface& s) const { return s.diffuse; }
    Rgb operator()(const Diffuse& s) const { return s.color; }
    Rgb operator()(const Conductor& s) const {
      const auto reflected = [](float eta, float k) {
        return ((eta - 1) * (eta - 1) + k * k) / ((eta + 1) * (eta + 1) + k * k);
      };
      return {reflected(s.eta.r, s.k.r), reflected(s.eta.g, s.k.g), reflected(s.eta.b, s.k.b)};
    }
    Rgb operator()(const Dielectric& s) const { return s.color; }
    Rgb operator()(const MetallicRoughness& s) const { return s.base_color; }
    Rgb operator()(const Layered& s) const { return s.base_color; }
    Rgb operator()(const Unlit& s) const { return s.color; }
  };
  return std::visit(ColorOf{}, surface);
}

bool lets_light_in(const Surface& surface) {
  if (const auto* whitted = std::get_if<WhittedSurface>(&surface)) return !whitted->transmit.is_black();
  if (const auto* layered = std::get_if<Layered>(&surface)) return layered->transmission > 0 && !layered->thin;
  return std::holds_alternative<Dielectric>(surface);
}

bool is_black(const Surface& surface) {
  if (std::holds_alternative<Unlit>(surface)) return true;
  if (const auto* diffuse = std::get_if<Diffuse>(&surface)) return diffuse->color.is_black();
  const auto* s = std::get_if<WhittedSurface>(&surface);
  return s && s->diffuse.is_black() && s->specular.is_black() && s->reflect.is_black() && s->transmit.is_black();
}

}  // namespace tessera
