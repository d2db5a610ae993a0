#include "proto/import/gltf/materials.h"

#include <algorithm>
#include <array>
#include <numbers>
#include <string>
#include <utility>

#include "core/math/portable.h"
#include "core/scene/light.h"
#include "proto/read_values.h"

namespace tessera::proto {
class GltfMaterials::Reader {
 public:
  Reader(GltfFile& file, GltfTextures& textures) : file_(file), textures_(textures) {}

  Source read_material(const GltfObject& object) {
    out_ = {};
    Material& material = out_.material;
    MetallicRoughness base;
    read_alpha_mode(object);
    // The older model is meant where a file has both: the other is for readers that don't know it.
    const auto glossy = object.extension("KHR_materials_pbrSpecularGlossiness");
    const auto pbr = object.object("pbrMetallicRoughness");
    if (pbr && !glossy) read_base(*pbr, base);
    read_emission(object);
    if (const auto normal = object.object("normalTexture")) {
      float scale = 1;
      read(normal->find("scale"), scale);
      add(normal, TextureSlot::normal, 0, false, scale);
    }
    if (const auto occlusion = object.object("occlusionTexture")) {
      float strength = 1;
      read(occlusion->find("strength"), strength, kFraction);
      textures_.read_info(occlusion);
      file_.note(occlusion->value(), "An occlusion texture is ignored: what lies in the shade is found by rays");
    }
    bool both_sides = false;
    read(object.find("doubleSided"), both_sides);
    material.emits_both_sides = both_sides;
    material.surface = base;
    out_.has_alpha = has_alpha_;
    if (glossy)
      read_specular_glossiness(*glossy);
    else
      read_extensions(object, base);
    return std::move(out_);
  }

 private:
  /// What a medium takes of light per metre that leaves so much of it after a distance; of black, nearly all.
  static Rgb absorption(const std::array<float, 3>& left, float distance) {
    const auto taken = [distance](float share) {
      constexpr float kLeast = 1e-4F;
      constexpr double kMost = 1e18;
      return static_cast<float>(
          std::min(-portable_log2(std::max(share, kLeast)) * std::numbers::ln2 / distance, kMost));
    };
    return {taken(left[0]), taken(left[1]), taken(left[2])};
  }

  void add(const std::optional<GltfObject>& object, TextureSlot slot, std::uint8_t channel, bool is_srgb = false,
           float scale = 1) {
    if (const auto info = textures_.read_info(object))
      out_.textures.push_back({{slot, 0, channel, scale}, *info, is_srgb});
  }

  static Rgb rgb(const std::array<float, 3>& numbers) { return {numbers[0], numbers[1], numbers[2]}; }

  void read_alpha_mode(const GltfObject& object) {
    std::string_view mode = "OPAQUE";
    const auto field = object.find("alphaMode"), cutoff = object.find("alphaCutoff");
    if (field && field->kind() != JsonKind::string) field->expected("one of OPAQUE, MASK and BLEND");
    if (field && field->kind() == JsonKind::string) mode = field->string();
    if (mode != "OPAQUE" && mode != "MASK" && mode != "BLEND")
      file_.note(*field, "An alpha mode that glTF doesn't know counts as OPAQUE");
    float least = 0.5F;
    read(cutoff, least, kNotNegative);
    is_mask_ = mode == "MASK" && least > 0;
    has_alpha_ = is_mask_ || mode == "BLEND";
    out_.material.alpha_cutoff = is_mask_ ? least : 0;
  }

  void read_base(const GltfObject& pbr, MetallicRoughness& base) {
    std::array<float, 4> color{1, 1, 1, 1};
    read_numbers(pbr.find("baseColorFactor"), color, kFraction);
    base.base_color = {color[0], color[1], color[2]};
    if (has_alpha_) out_.material.alpha = color[3];
    read(pbr.find("metallicFactor"), base.metallic, kFraction);
    read(pbr.find("roughnessFactor"), base.roughness, kFraction);
    const auto color_texture = pbr.object("baseColorTexture"), pair = pbr.object("metallicRoughnessTexture");
    add(color_texture, TextureSlot::base_color, 0, true);
    if (has_alpha_) add(color_texture, TextureSlot::alpha, 3, true);
    add(pair, TextureSlot::roughness, 1);
    add(pair, TextureSlot::metallic, 2);
  }

  /// A dielectric whose reflectance, head on, is its specular colour: one of infinite index, tinted (KHR_materials_ior
  /// says so of files that are converted).
  void read_specular_glossiness(const GltfObject& object) {
    std::array<float, 4> color{1, 1, 1, 1};
    std::array<float, 3> specular{1, 1, 1};
    float glossiness = 1;
    read_numbers(object.find("diffuseFactor"), color, kFraction);
    read_numbers(object.find("specularFactor"), specular, kFraction);
    read(object.find("glossinessFactor"), glossiness, kFraction);
    if (has_alpha_) out_.material.alpha = color[3];
    out_.material.surface = Layered{.base_color = {color[0], color[1], color[2]},
                                    .metallic = 0,
                                    .roughness = 1 - glossiness,
                                    .ior = 0,
                                    .specular_color = rgb(specular)};
    const auto diffuse = object.object("diffuseTexture"), pair = object.object("specularGlossinessTexture");
    add(diffuse, TextureSlot::base_color, 0, true);
    if (has_alpha_) add(diffuse, TextureSlot::alpha, 3, true);
    add(pair, TextureSlot::specular_color, 0, true);
    add(pair, TextureSlot::glossiness, 3, true);
  }

  void read_emission(const GltfObject& object) {
    std::array<float, 3> factor{};
    float strength = 1;
    read_numbers(object.find("emissiveFactor"), factor, kFraction);
    if (const auto extension = object.extension("KHR_materials_emissive_strength"))
      read(extension->find("emissiveStrength"), strength, kLightChannel);
    out_.material.emission = rgb(factor) * strength;
    const auto texture = object.object("emissiveTexture");
    if (!out_.material.emission.is_black()) {
      add(texture, TextureSlot::emission, 0, true);
    } else {
      textures_.read_info(texture);
    }
  }

  void read_extensions(const GltfObject& object, const MetallicRoughness& base) {
    Layered layers{.base_color = base.base_color, .metallic = base.metallic, .roughness = base.roughness};
    bool are_there = false;
    const auto find = [&](std::string_view name) {
      auto extension = object.extension(name);
      are_there |= extension.has_value();
      return extension;
    };
    if (const auto ior = find("KHR_materials_ior")) read_ior(*ior, layers);
    if (const auto specular = find("KHR_materials_specular")) read_specular(*specular, layers);
    if (const auto transmission = find("KHR_materials_transmission")) {
      read(transmission->find("transmissionFactor"), layers.transmission, kFraction);
      add(transmission->object("transmissionTexture"), TextureSlot::transmission, 0);
    }
    if (const auto volume = find("KHR_materials_volume")) read_volume(*volume, layers);
    if (const auto coat = find("KHR_materials_clearcoat")) read_clearcoat(*coat, layers);
    if (const auto sheen = find("KHR_materials_sheen")) read_sheen(*sheen, layers);
    if (are_there) out_.material.surface = layers;
    if (!lets_light_in(out_.material.surface)) out_.material.absorption = {};
    if (object.extension("KHR_materials_unlit")) make_unlit(base);
  }

  static void read_ior(const GltfObject& extension, Layered& layers) {
    const auto ior = extension.find("ior");
    if (read(ior, layers.ior, kNotNegative) && layers.ior > 0 && layers.ior < 1)
      ior->expected("an index of refraction of at least 1, or 0");
  }

  void read_specular(const GltfObject& specular, Layered& layers) {
    std::array<float, 3> color{1, 1, 1};
    read(specular.find("specularFactor"), layers.specular, kFraction);
    read_numbers(specular.find("specularColorFactor"), color, kNotNegative);
    layers.specular_color = rgb(color);
    add(specular.object("specularTexture"), TextureSlot::specular, 3);
    add(specular.object("specularColorTexture"), TextureSlot::specular_color, 0, true);
  }

  void read_volume(const GltfObject& volume, Layered& layers) {
    float thickness = 0;
    const auto factor = volume.find("thicknessFactor");
    read(factor, thickness, kNotNegative);
    layers.thin = thickness == 0;
    if (thickness > 0) file_.note(*factor, "A volume is as thick as its mesh, whatever its thickness says");
    float distance = 0;
    std::array<float, 3> left{1, 1, 1};
    read(volume.find("attenuationDistance"), distance, kPositive);
    read_numbers(volume.find("attenuationColor"), left, kFraction);
    if (distance > 0) out_.material.absorption = absorption(left, distance);
    textures_.read_info(volume.object("thicknessTexture"));
  }

  void read_clearcoat(const GltfObject& coat, Layered& layers) {
    read(coat.find("clearcoatFactor"), layers.clearcoat, kFraction);
    read(coat.find("clearcoatRoughnessFactor"), layers.clearcoat_roughness, kFraction);
    add(coat.object("clearcoatTexture"), TextureSlot::clearcoat, 0);
    add(coat.object("clearcoatRoughnessTexture"), TextureSlot::clearcoat_roughness, 1);
    if (const auto normal = coat.object("clearcoatNormalTexture")) {
      textures_.read_info(normal);
      file_.note(normal->value(), "A normal texture of a clear coat is ignored: it is as smooth as the mesh");
    }
  }

  void read_sheen(const GltfObject& sheen, Layered& layers) {
    std::array<float, 3> color{};
    read_numbers(sheen.find("sheenColorFactor"), color, kFraction);
    layers.sheen_color = rgb(color);
    read(sheen.find("sheenRoughnessFactor"), layers.sheen_roughness, kFraction);
    add(sheen.object("sheenColorTexture"), TextureSlot::sheen_color, 0, true);
    add(sheen.object("sheenRoughnessTexture"), TextureSlot::sheen_roughness, 3);
  }

  /// It shows its colour and nothing else.
  void make_unlit(const MetallicRoughness& base) {
    out_.material.surface = Unlit{base.base_color};
    out_.material.emission = {};
    std::erase_if(out_.textures, [](const Use& use) {
      return use.use.slot != TextureSlot::base_color && use.use.slot != TextureSlot::alpha;
    });
  }

  GltfFile& file_;
  GltfTextures& textures_;
  Source out_;
  bool has_alpha_ = false, is_mask_ = false;
};

GltfMaterials::GltfMaterials(GltfFile& file, GltfTextures& textures) : textures_(textures) {
  default_.material.surface = MetallicRoughness{};
  Reader reader(file, textures);
  for (const JsonCursor& material : file.root().array("materials"))
    materials_.push_back(reader.read_material(GltfObject(material)));
}

UsedUvs GltfMaterials::used_uvs() const {
  UsedUvs used(materials_.size());
  for (std::size_t i = 0; i < materials_.size(); ++i)
    for (const Use& use : materials_[i].textures) used[i][use.info.uv_set] = true;
  return used;
}

std::uint32_t GltfMaterials::use(std::optional<std::uint32_t> material, bool has_colors) {
  Source& source = material ? materials_[*material] : default_;
  if (!source.used) {
    source.used = static_cast<std::uint32_t>(out_.size());
    Material& out = out_.emplace_back(source.material);
    for (const Use& use : source.textures) {
      const auto texture = textures_.use(use.info, use.is_srgb);
      if (!texture) continue;
      out.textures.push_back(use.use);
      out.textures.back().texture = *texture;
    }
  }
  Material& out = out_[*source.used];
  out.has_vertex_colors |= has_colors;
  out.has_vertex_alpha |= has_colors && source.has_alpha;
  return *source.used;
}

}  // namespace tessera::proto
