#include "core/material/surface_at.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <type_traits>
#include <variant>

#include "core/geometry/triangle.h"
#include "core/material/texture_lookup.h"

namespace tessera {
namespace {

/// Of a triangle, at one point.
struct Attributes {
  const TriangleMesh& mesh;
  TriangleIndices corners;
  std::array<float, 3> share;

  Attributes(const TriangleMesh& of, std::uint32_t primitive, double second, double third)
      : mesh(of),
        corners(of.triangles[primitive]),
        share{static_cast<float>(1 - second - third), static_cast<float>(second), static_cast<float>(third)} {}

  Vec2 uv_of(std::size_t corner, std::uint8_t set) const {
    if (!mesh.attributes || mesh.attributes->uvs[set].empty()) return {};
    return mesh.attributes->uvs[set][corners[corner]];
  }

  Vec2 uv(std::uint8_t set) const {
    const Vec2 a = uv_of(0, set), b = uv_of(1, set), c = uv_of(2, set);
    return {a.x * share[0] + b.x * share[1] + c.x * share[2], a.y * share[0] + b.y * share[1] + c.y * share[2]};
  }

  Rgba color() const {
    if (!mesh.attributes || mesh.attributes->colors.empty()) return {1, 1, 1, 1};
    const auto& colors = mesh.attributes->colors;
    Rgba out{};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 4; ++k) out[k] += colors[corners[i]][k] * share[i];
    return out;
  }
};

/// Looks textures up; one that several slots share, once in a row.
class Lookups {
 public:
  Lookups(const Scene& scene, const Attributes& at) : scene_(scene), at_(at) {}

  const Rgba& operator[](std::uint32_t texture) {
    if (texture != last_) {
      const Texture& of = scene_.textures[texture];
      value_ = look_up(of, at_.uv(of.uv_set));
      last_ = texture;
    }
    return value_;
  }

 private:
  const Scene& scene_;
  const Attributes& at_;
  std::uint32_t last_ = 0xFFFFFFFF;
  Rgba value_{};
};

const TriangleMesh* mesh_of(const Scene& scene, const Object& object) {
  return std::get_if<TriangleMesh>(&scene.shapes[object.shape]);
}

Rgb color_of(const Rgba& texel) { return {texel[0], texel[1], texel[2]}; }

/// Files of floats hold more.
float fraction(float number) { return std::min(number, 1.0F); }
Rgb reflectance_of(const Rgba& texel) { return {fraction(texel[0]), fraction(texel[1]), fraction(texel[2])}; }

Rgb* color_of(Surface& surface) {
  return std::visit(
      [](auto& s) -> Rgb* {
        using S = std::decay_t<decltype(s)>;
        if constexpr (std::is_same_v<S, WhittedSurface>)
          return &s.diffuse;
        else if constexpr (requires { s.base_color; })
          return &s.base_color;
        else if constexpr (requires { s.color; })
          return &s.color;
        else
          return nullptr;
      },
      surface);
}

void scale(Rgb* color, Rgb by) {
  if (color) *color = *color * by;
}

float* number_of(Surface& surface, TextureSlot slot) {
  return std::visit(
      [&](auto& s) -> float* {
        if constexpr (requires { s.metallic; })
          if (slot == TextureSlot::metallic) return &s.metallic;
        if constexpr (requires { s.roughness; })
          if (slot == TextureSlot::roughness) return &s.roughness;
        if constexpr (std::is_same_v<std::decay_t<decltype(s)>, Layered>) {
          if (slot == TextureSlot::specular) return &s.specular;
          if (slot == TextureSlot::transmission) return &s.transmission;
          if (slot == TextureSlot::clearcoat) return &s.clearcoat;
          if (slot == TextureSlot::clearcoat_roughness) return &s.clearcoat_roughness;
          if (slot == TextureSlot::sheen_roughness) return &s.sheen_roughness;
        }
        return nullptr;
      },
      surface);
}

/// The directions, in the mesh's space, in which a texture's u and v grow, as its transform leaves them, per unit of
/// each; nothing where the texture has no area on the triangle.
struct UvAxes {
  Vec3d u, v;
};
std::optional<UvAxes> uv_axes(const Attributes& at, const Texture& texture) {
  const std::uint8_t set = texture.uv_set;
  const auto& m = texture.transform;
  const Vec2 a = at.uv_of(0, set), b = at.uv_of(1, set), c = at.uv_of(2, set);
  const auto along = [&](Vec2 corner, std::size_t row) {
    return m[row] * (double{corner.x} - a.x) + m[row + 1] * (double{corner.y} - a.y);
  };
  const double du1 = along(b, 0), dv1 = along(b, 3), du2 = along(c, 0), dv2 = along(c, 3);
  const double area = du1 * dv2 - du2 * dv1;
  if (!(std::abs(area) > 0)) return std::nullopt;
  const auto position = [&](std::size_t i) { return to_double(at.mesh.positions[at.corners[i]]); };
  const Vec3d ab = position(1) - position(0), ac = position(2) - position(0);
  return UvAxes{(ab * dv2 - ac * dv1) / area, (ac * du1 - ab * du2) / area};
}

/// A direction of the mesh, in the world, across `normal`, unit; nothing where it lies along it.
std::optional<Vec3d> across(const Object& object, Vec3d direction, Vec3d normal) {
  if (object.placement) {
    const auto& m = object.placement->rows();
    direction = {dot({m[0], m[1], m[2]}, direction), dot({m[4], m[5], m[6]}, direction),
                 dot({m[8], m[9], m[10]}, direction)};
  }
  const Vec3d flat = direction - normal * dot(direction, normal);
  const double most = max_component(abs(flat));
  if (!(most > 1e-9 * max_component(abs(direction)))) return std::nullopt;
  const Vec3d scaled = flat / most;
  return scaled / length(scaled);
}

double sign_of(double v) { return v < 0 ? -1 : 1; }

bool is_mirrored(const Object& object) {
  if (!object.placement) return false;
  const auto& m = object.placement->rows();
  return dot(cross(Vec3d{m[0], m[4], m[8]}, Vec3d{m[1], m[5], m[9]}), {m[2], m[6], m[10]}) < 0;
}

/// To the right in the image, and up; unit, across the normal.
struct Frame {
  Vec3d right, up;
};
std::optional<Frame> frame_along(const UvAxes& axes, const Object& object, Vec3d normal) {
  const auto tangent = across(object, axes.u, normal), v = across(object, axes.v, normal);
  if (!tangent || !v) return std::nullopt;
  const Vec3d up = cross(normal, *tangent);
  return Frame{*tangent, up * -sign_of(dot(up, *v))};
}

/// Tangents that the mesh has stand as they are, whatever the texture's transform; without them the image lies along
/// its transformed coordinates: as in Khronos' glTF Sample Viewer.
std::optional<Frame> frame_at(const Object& object, const Attributes& at, const Texture& texture, Vec3d normal) {
  const bool mirrored = is_mirrored(object);
  if (texture.uv_set == 0 && at.mesh.attributes && !at.mesh.attributes->tangents.empty()) {
    Vec3d direction{};
    double sign = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Tangent& tangent = at.mesh.attributes->tangents[at.corners[i]];
      direction = direction + to_double(tangent.direction) * double{at.share[i]};
      sign += double{tangent.sign} * at.share[i];
    }
    if (const auto tangent = across(object, direction, normal))
      return Frame{*tangent, cross(normal, *tangent) * (sign_of(sign) * (mirrored ? -1 : 1))};
  }
  const auto axes = uv_axes(at, texture);
  return axes ? frame_along(*axes, object, normal) : std::nullopt;
}

void turn(SurfacePoint& point, const Frame& frame, double right, double up, double out) {
  const Vec3d turned = frame.right * right + frame.up * up + point.shading_normal * out;
  const double most = max_component(abs(turned));
  if (!(most > 0) || !(out > 0) || !std::isfinite(right + up)) return;
  const Vec3d scaled = turned / most;
  point.shading_normal = scaled / length(scaled);
  point.to_smooth = {};
}

void apply_normal_map(const Object& object, const Attributes& at, const TextureUse& use, const Texture& texture,
                      const Rgba& texel, SurfacePoint& point) {
  const double x = (2.0 * texel[0] - 1) * use.scale, y = (2.0 * texel[1] - 1) * use.scale, z = 2.0 * texel[2] - 1;
  if (const auto frame = frame_at(object, at, texture, point.shading_normal)) turn(point, *frame, x, y, z);
}

/// Blinn's (1978), by differences from texel to texel: the slopes along the axes of the image as it lies on the
/// surface, whatever tangents the mesh has.
void apply_bump_map(const Object& object, const Attributes& at, const TextureUse& use, const Texture& texture,
                    SurfacePoint& point) {
  const auto axes = uv_axes(at, texture);
  const auto frame = axes ? frame_along(*axes, object, point.shading_normal) : std::nullopt;
  if (!frame) return;
  const Vec2 uv = at.uv(texture.uv_set);
  const auto height = [&](double u, double v) {
    return double{look_up(texture, {static_cast<float>(u), static_cast<float>(v)})[use.channel]} * use.scale;
  };
  // Steps of a texel each: the transform's inverse leads there.
  const double du = 1.0 / texture.image->texels().width, dv = 1.0 / texture.image->texels().height;
  const auto& m = texture.transform;
  const double area = double{m[0]} * m[4] - double{m[1]} * m[3];
  const double here = height(uv.x, uv.y);
  const double rise_u = (height(uv.x + m[4] * du / area, uv.y - m[3] * du / area) - here) / du;
  const double rise_v = (height(uv.x - m[1] * dv / area, uv.y + m[0] * dv / area) - here) / dv;
  // Across u, towards the upper edge of the image, as far as v leads there.
  const Vec3d right = axes->u / length(axes->u);
  const double v_right = dot(axes->v, right), v_down = length(axes->v - right * v_right);
  const double slope_right = rise_u / length(axes->u), slope_down = (rise_v - v_right * slope_right) / v_down;
  turn(point, *frame, -slope_right, slope_down, 1);
}

}  // namespace

SurfaceAt surface_at(const Scene& scene, const Object& object, std::uint32_t primitive, SurfacePoint& point) {
  const Material& material = scene.materials[object.material];
  SurfaceAt out{material.surface, material.emission};
  const TriangleMesh* mesh = mesh_of(scene, object);
  if (!mesh) return out;
  const Attributes at(*mesh, primitive, point.second_share, point.third_share);
  Lookups lookups(scene, at);
  if (material.has_vertex_colors) scale(color_of(out.surface), color_of(at.color()));
  for (const TextureUse& use : material.textures) {
    switch (use.slot) {
      case TextureSlot::alpha:
        break;  // for alpha_at
      case TextureSlot::base_color:
        scale(color_of(out.surface), reflectance_of(lookups[use.texture]));
        break;
      case TextureSlot::emission:
        out.emission = out.emission * color_of(lookups[use.texture]);
        break;
      case TextureSlot::specular_color:
        if (auto* layered = std::get_if<Layered>(&out.surface))
          scale(&layered->specular_color, color_of(lookups[use.texture]));
        if (auto* whitted = std::get_if<WhittedSurface>(&out.surface)) {
          scale(&whitted->specular, reflectance_of(lookups[use.texture]));
          scale(&whitted->reflect, reflectance_of(lookups[use.texture]));
        }
        break;
      case TextureSlot::glossiness:
        if (auto* layered = std::get_if<Layered>(&out.surface))
          layered->roughness = 1 - (1 - layered->roughness) * fraction(lookups[use.texture][use.channel]);
        break;
      case TextureSlot::sheen_color:
        if (auto* layered = std::get_if<Layered>(&out.surface))
          scale(&layered->sheen_color, color_of(lookups[use.texture]));
        break;
      case TextureSlot::normal:
        apply_normal_map(object, at, use, scene.textures[use.texture], lookups[use.texture], point);
        break;
      case TextureSlot::bump:
        apply_bump_map(object, at, use, scene.textures[use.texture], point);
        break;
      default:
        if (float* number = number_of(out.surface, use.slot)) *number *= fraction(lookups[use.texture][use.channel]);
    }
  }
  return out;
}

Rgb emission_at(const Scene& scene, const Object& object, std::uint32_t primitive, double second_share,
                double third_share) {
  const Material& material = scene.materials[object.material];
  Rgb emission = material.emission;
  const TriangleMesh* mesh = mesh_of(scene, object);
  if (!mesh) return emission;
  const Attributes at(*mesh, primitive, second_share, third_share);
  Lookups lookups(scene, at);
  for (const TextureUse& use : material.textures)
    if (use.slot == TextureSlot::emission) emission = emission * color_of(lookups[use.texture]);
  return emission;
}

double mean_emission(const Scene& scene, const Object& object, std::uint32_t primitive) {
  const Material& material = scene.materials[object.material];
  double emission = mean(material.emission);
  const TriangleMesh* mesh = mesh_of(scene, object);
  if (!mesh) return emission;
  const Attributes at(*mesh, primitive, 0, 0);
  for (const TextureUse& use : material.textures) {
    if (use.slot != TextureSlot::emission) continue;
    const Texture& texture = scene.textures[use.texture];
    const std::uint8_t set = texture.uv_set;
    emission *= mean_around(texture, {at.uv_of(0, set), at.uv_of(1, set), at.uv_of(2, set)});
  }
  return emission;
}

float alpha_at(const Scene& scene, const Object& object, std::uint32_t primitive, const Ray& ray) {
  const Material& material = scene.materials[object.material];
  float alpha = material.alpha;
  const TriangleMesh* mesh = alpha_varies(material) ? mesh_of(scene, object) : nullptr;
  if (mesh) {
    const Ray local = object.placement ? object.placement->to_local(ray) : ray;
    const TriangleIndices& i = mesh->triangles[primitive];
    const Vec3 a = mesh->positions[i[0]], b = mesh->positions[i[1]], c = mesh->positions[i[2]];
    const TriangleRay seen(local);
    const TriangleWeights w =
        crossing(seen, seen.see(a), seen.see(b), seen.see(c), a, b, c).value_or(TriangleWeights{1, 1, 1});
    const Attributes at(*mesh, primitive, w.b / w.sum(), w.c / w.sum());
    if (material.has_vertex_alpha) alpha *= at.color()[3];
    for (const TextureUse& use : material.textures) {
      if (use.slot != TextureSlot::alpha) continue;
      const Texture& texture = scene.textures[use.texture];
      alpha *= look_up(texture, at.uv(texture.uv_set))[use.channel];
    }
  }
  if (material.alpha_cutoff > 0) return alpha >= material.alpha_cutoff ? 1 : 0;
  return fraction(alpha);
}

}  // namespace tessera
