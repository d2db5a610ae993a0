#include "proto/read_material.h"

#include "proto/read_values.h"

namespace tessera::proto {
namespace {

enum class MaterialType { diffuse, phong, mirror, dielectric, whitted };

constexpr Rgb kBlack{};

Surface read_diffuse(JsonFields& fields) {
  fields.call("a diffuse material");
  Diffuse diffuse;
  read_color(fields.required("color"), diffuse.color, kFraction);
  return diffuse;
}

Surface read_phong(JsonFields& fields) {
  fields.call("a phong material");
  WhittedSurface material;
  read_color(fields.required("diffuse"), material.diffuse, kFraction);
  read_color(fields.required("specular"), material.specular, kFraction);
  read(fields.required("shininess"), material.shininess, kNotNegative);
  return material;
}

Surface read_mirror(JsonFields& fields) {
  fields.call("a mirror material");
  WhittedSurface material;
  material.diffuse = kBlack;
  read_color(fields.required("color"), material.reflect, kFraction);
  return material;
}

Surface read_dielectric(JsonFields& fields) {
  fields.call("a dielectric material");
  Dielectric glass;
  read(fields.required("ior"), glass.ior, kPositive);
  read_color(fields.optional("color"), glass.color, kFraction);
  return glass;
}

Surface read_whitted(JsonFields& fields) {
  fields.call("a whitted material");
  WhittedSurface material;
  read_color(fields.optional("diffuse"), material.diffuse, kFraction);
  read_color(fields.optional("specular"), material.specular, kFraction);
  read(fields.optional("shininess"), material.shininess, kNotNegative);
  read_color(fields.optional("reflect"), material.reflect, kFraction);
  read_color(fields.optional("transmit"), material.transmit, kFraction);
  read(fields.optional("ior"), material.ior, kPositive);
  read(fields.optional("fresnel"), material.fresnel);
  return material;
}

Surface read_fields(MaterialType type, JsonFields& fields) {
  switch (type) {
    case MaterialType::diffuse:
      return read_diffuse(fields);
    case MaterialType::phong:
      return read_phong(fields);
    case MaterialType::mirror:
      return read_mirror(fields);
    case MaterialType::dielectric:
      return read_dielectric(fields);
    case MaterialType::whitted:
      return read_whitted(fields);
  }
  return {};
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
                                          {"whitted", MaterialType::whitted}})) {
    return std::nullopt;
  }
  const Material material{read_fields(type, fields)};
  fields.refuse_unknown();
  return material;
}

}  // namespace tessera::proto
