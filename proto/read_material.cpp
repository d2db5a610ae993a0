#include "proto/read_material.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "proto/read_values.h"

namespace tessera::proto {
namespace {

enum class MaterialType { diffuse, phong, mirror, whitted, dielectric, conductor, metallic_roughness, unlit };

constexpr Rgb kBlack{};
constexpr NumberRange kIor{1e-3F, 1e3F, false, "a number from 0.001 to 1000"};
constexpr NumberRange kConductorK{0, 1e3F, false, "a number from 0 to 1000"};

struct ComplexIor {
  Rgb eta, k;
};

/// Measured spectra (SOPRA's tables), weighed into linear Rec. 709.
const std::initializer_list<Choice<ComplexIor>> kMetals{
    {"aluminium", {{1.657F, 0.8804F, 0.5212F}, {9.224F, 6.270F, 4.837F}}},
    {"chromium", {{4.370F, 2.917F, 1.655F}, {5.206F, 4.231F, 3.755F}}},
    {"copper", {{0.2004F, 0.9240F, 1.102F}, {3.913F, 2.453F, 2.142F}}},
    {"gold", {{0.1431F, 0.3750F, 1.442F}, {3.983F, 2.386F, 1.603F}}},
    {"silver", {{0.1553F, 0.1167F, 0.1384F}, {4.828F, 3.122F, 2.147F}}},
};

Surface read_diffuse(JsonFields& fields) {
  fields.call("a diffuse material");
  Diffuse surface;
  read_color(fields.required("color"), surface.color, kFraction);
  return surface;
}

Surface read_phong(JsonFields& fields) {
  fields.call("a phong material");
  WhittedSurface surface;
  read_color(fields.required("diffuse"), surface.diffuse, kFraction);
  read_color(fields.required("specular"), surface.specular, kFraction);
  read(fields.required("shininess"), surface.shininess, kNotNegative);
  return surface;
}

Surface read_mirror(JsonFields& fields) {
  fields.call("a mirror material");
  WhittedSurface surface;
  surface.diffuse = kBlack;
  read_color(fields.required("color"), surface.reflect, kFraction);
  return surface;
}

Surface read_whitted(JsonFields& fields) {
  fields.call("a whitted material");
  WhittedSurface surface;
  read_color(fields.optional("diffuse"), surface.diffuse, kFraction);
  read_color(fields.optional("specular"), surface.specular, kFraction);
  read(fields.optional("shininess"), surface.shininess, kNotNegative);
  read_color(fields.optional("reflect"), surface.reflect, kFraction);
  read_color(fields.optional("transmit"), surface.transmit, kFraction);
  read(fields.optional("ior"), surface.ior, kPositive);
  read(fields.optional("fresnel"), surface.fresnel);
  return surface;
}

Surface read_dielectric(JsonFields& fields) {
  fields.call("a dielectric material");
  Dielectric surface;
  read(fields.required("ior"), surface.ior, kIor);
  read(fields.optional("roughness"), surface.roughness, kFraction);
  read_color(fields.optional("color"), surface.color, kFraction);
  return surface;
}

/// The absorption with which a conductor of eta 1 reflects that much at normal incidence (pbrt-v4). The whole can't be.
float absorption_of(float reflectance) {
  const float r = std::min(reflectance, 0.9999F);
  return 2 * std::sqrt(r) / std::sqrt(1 - r);
}

Surface read_conductor(JsonFields& fields) {
  fields.call("a conductor");
  const auto eta = fields.optional("eta"), k = fields.optional("k"), color = fields.optional("color"),
             metal = fields.optional("metal");
  ComplexIor ior{{1, 1, 1}, {1, 1, 1}};
  const int ways = (eta || k ? 1 : 0) + (color ? 1 : 0) + (metal ? 1 : 0);
  if (ways != 1 || eta.has_value() != k.has_value()) {
    fields.value().error(
        "A conductor needs \"metal\", or \"color\" (what it reflects at normal incidence), or both of \"eta\" and "
        "\"k\" (its complex index of refraction), and only one of these ways.");
  } else if (eta) {
    read_color(eta, ior.eta, kIor);
    read_color(k, ior.k, kConductorK);
  } else if (color) {
    Rgb f0{};
    read_color(color, f0, kFraction);
    ior.k = {absorption_of(f0.r), absorption_of(f0.g), absorption_of(f0.b)};
  } else {
    read(metal, ior, kMetals);
  }
  Conductor surface{ior.eta, ior.k};
  read(fields.optional("roughness"), surface.roughness, kFraction);
  return surface;
}

/// One that says something only where another is there.
std::optional<JsonCursor> read_beside(JsonFields& fields, const char* name, const char* other,
                                      std::optional<JsonCursor> other_value) {
  const auto value = fields.optional(name);
  if (value && !other_value)
    value->error('"' + std::string(name) + "\" says more of \"" + other + "\", and there is none; add it.");
  return value;
}

/// glTF's material; `Layered` where it has anything of the extensions.
Surface read_metallic_roughness(JsonFields& fields) {
  fields.call("a metallic_roughness material");
  Layered surface;
  read_color(fields.optional("base_color"), surface.base_color, kFraction);
  read(fields.optional("metallic"), surface.metallic, kFraction);
  read(fields.optional("roughness"), surface.roughness, kFraction);
  const auto ior = fields.optional("ior"), specular = fields.optional("specular"),
             specular_color = fields.optional("specular_color"), transmission = fields.optional("transmission"),
             clearcoat = fields.optional("clearcoat"), sheen = fields.optional("sheen_color");
  read(ior, surface.ior, kIor);
  read(specular, surface.specular, kFraction);
  read_color(specular_color, surface.specular_color, kNotNegative);
  read(transmission, surface.transmission, kFraction);
  read(read_beside(fields, "thin", "transmission", transmission), surface.thin);
  read(clearcoat, surface.clearcoat, kFraction);
  read(read_beside(fields, "clearcoat_roughness", "clearcoat", clearcoat), surface.clearcoat_roughness, kFraction);
  read_color(sheen, surface.sheen_color, kFraction);
  read(read_beside(fields, "sheen_roughness", "sheen_color", sheen), surface.sheen_roughness, kFraction);
  if (ior || specular || specular_color || transmission || clearcoat || sheen) return surface;
  return MetallicRoughness{surface.base_color, surface.metallic, surface.roughness};
}

Surface read_unlit(JsonFields& fields) {
  fields.call("an unlit material");
  Unlit surface;
  read_color(fields.required("color"), surface.color, kLightChannel);
  return surface;
}

/// Of the kinds that may let light in.
void read_absorption(JsonFields& fields, Material& material) {
  const auto absorption = fields.optional("absorption");
  read_color(absorption, material.absorption, kNotNegative);
  if (absorption && !lets_light_in(material.surface))
    absorption->error(
        "\"absorption\" is of what is inside, and this material lets no light in; give it \"transmit\", or "
        "\"transmission\" with \"thin\": false.");
}

Surface read_surface(MaterialType type, JsonFields& fields) {
  switch (type) {
    case MaterialType::diffuse:
      return read_diffuse(fields);
    case MaterialType::phong:
      return read_phong(fields);
    case MaterialType::mirror:
      return read_mirror(fields);
    case MaterialType::whitted:
      return read_whitted(fields);
    case MaterialType::dielectric:
      return read_dielectric(fields);
    case MaterialType::conductor:
      return read_conductor(fields);
    case MaterialType::metallic_roughness:
      return read_metallic_roughness(fields);
    case MaterialType::unlit:
      return read_unlit(fields);
  }
  return {};
}

/// What any material may have beside its surface.
void read_common(JsonFields& fields, Material& material) {
  const auto emission = fields.optional("emission"), emits = fields.optional("emits");
  read_color(emission, material.emission, kLightChannel);
  read<bool>(emits, material.emits_both_sides, {{"front", false}, {"both", true}});
  if (emits && !emission) emits->error("\"emits\" says where \"emission\" goes, and there is none; add it.");
  read(fields.optional("alpha"), material.alpha, kFraction);
}

}  // namespace

std::optional<Material> read_material(JsonCursor value) {
  JsonFields fields(value, "a material");
  MaterialType type{};
  const auto type_field = fields.required("type");
  if (!type_field || !read<MaterialType>(type_field, type,
                                         {{"diffuse", MaterialType::diffuse},
                                          {"phong", MaterialType::phong},
                                          {"mirror", MaterialType::mirror},
                                          {"dielectric", MaterialType::dielectric},
                                          {"whitted", MaterialType::whitted},
                                          {"conductor", MaterialType::conductor},
                                          {"metallic_roughness", MaterialType::metallic_roughness},
                                          {"unlit", MaterialType::unlit}})) {
    return std::nullopt;
  }
  Material material;
  material.surface = read_surface(type, fields);
  if (type == MaterialType::dielectric || type == MaterialType::whitted || type == MaterialType::metallic_roughness)
    read_absorption(fields, material);
  read_common(fields, material);
  fields.refuse_unknown();
  return material;
}

}  // namespace tessera::proto
