#include "proto/import/gltf/meshes.h"

#include <algorithm>
#include <charconv>

namespace tessera::proto {
namespace {

/// A semantic without its number, and the number.
struct Semantic {
  std::string_view name;
  std::optional<std::uint32_t> set;
};

/// Nothing for names that glTF doesn't allow.
std::optional<Semantic> semantic_of(std::string_view name) {
  if (name == "POSITION" || name == "NORMAL" || name == "TANGENT" || name.starts_with('_')) return Semantic{name, {}};
  const std::size_t line = name.find('_');
  if (line == name.npos) return std::nullopt;
  const std::string_view digits = name.substr(line + 1);
  std::uint32_t set = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), set);
  const bool is_number = error == std::errc() && end == digits.data() + digits.size();
  if (!is_number || (digits.size() > 1 && digits.front() == '0')) return std::nullopt;
  constexpr std::string_view kSets[] = {"TEXCOORD", "COLOR", "JOINTS", "WEIGHTS"};
  const auto known = std::ranges::find(kSets, name.substr(0, line));
  return known == std::ranges::end(kSets) ? std::nullopt : std::optional<Semantic>({*known, set});
}

constexpr std::string_view kReadAttributes[] = {"POSITION",   "NORMAL",  "TANGENT",  "TEXCOORD_0",
                                                "TEXCOORD_1", "COLOR_0", "JOINTS_0", "WEIGHTS_0"};

bool is_float(const Accessor& a) { return a.type == ComponentType::float32; }

bool is_fraction(const Accessor& a) {
  return a.is_normalized && (a.type == ComponentType::uint8 || a.type == ComponentType::uint16);
}

bool is_signed_fraction(const Accessor& a) {
  return a.is_normalized && (a.type == ComponentType::int8 || a.type == ComponentType::int16);
}

bool is_short_integer(const Accessor& a) { return !is_float(a) && a.type != ComponentType::uint32; }

class MeshReader {
 public:
  MeshReader(GltfFile& file, GltfBuffers& buffers, const Accessors& accessors, const UsedUvs& materials,
             std::optional<std::uint32_t> variant)
      : file_(file), buffers_(buffers), accessors_(accessors), materials_(materials), variant_(variant) {
    // Looked at alone: whether quantised attributes are declared.
    for (const JsonCursor& name : file.root().array("extensionsUsed"))
      is_quantized_ |= name.kind() == JsonKind::string && name.string() == "KHR_mesh_quantization";
  }

  GltfMesh read_mesh(const GltfObject& object) {
    GltfMesh mesh;
    object.required("primitives");
    for (const JsonCursor& element : object.array("primitives")) {
      file_.steps().take();
      const GltfObject primitive(element);
      if (element.kind() != JsonKind::object) continue;
      const std::size_t targets = check_targets(primitive);
      if (!mesh.primitives.empty() && targets != mesh.targets) {
        primitive.find("targets").value_or(element).error(
            "All primitives of a mesh have the same number of morph targets.");
      }
      mesh.targets = targets;
      mesh.primitives.push_back(read_primitive(primitive));
      mesh.has_joints |= mesh.primitives.back().joints.has_value();
    }
    if (const auto weights = object.array("weights"); !weights.empty()) {
      std::vector<double> numbers(weights.size());
      read_numbers(object.find("weights"), numbers);
      mesh.has_weights = std::ranges::any_of(numbers, [](double w) { return w != 0; });
      if (weights.size() != mesh.targets)
        object.find("weights")->error("There are " + std::to_string(mesh.targets) + " morph targets, not " +
                                      std::to_string(weights.size()) + ".");
    }
    return mesh;
  }

 private:
  Primitive read_primitive(const GltfObject& object) {
    Primitive p{.where = object.value()};
    std::uint32_t mode = 4;
    read(object.find("mode"), mode, 0, UINT32_MAX);
    if (mode <= static_cast<std::uint32_t>(Topology::triangle_fan)) {
      p.topology = static_cast<Topology>(mode);
    } else {
      p.topology = Topology::points;  // which aren't shown either
      file_.note(object.value(), "A primitive of a mode that glTF doesn't know is ignored");
    }
    p.draco = read_draco(object);
    object.required("attributes");
    if (const auto attributes = object.object("attributes")) read_attributes(*attributes, p);
    p.indices = read_reference(object.find("indices"), accessors_.size(), "accessor");
    if (p.indices && !check_indices(accessors_[*p.indices], *object.find("indices"))) p.indices.reset();
    p.material = read_material(object, p);
    return p;
  }

  void read_attributes(const GltfObject& attributes, Primitive& p) {
    if (attributes.value().size() == 0) attributes.value().expected("at least one attribute");
    std::optional<std::uint64_t> count;
    std::map<std::string_view, std::vector<std::uint32_t>> sets;
    attributes.value().each_member([&](std::string_view name, JsonCursor value) {
      const auto semantic = semantic_of(name);
      if (!semantic) {
        value.error("glTF has no attribute of that name; an application's own begin with \"_\".");
        return;
      }
      if (semantic->set) sets[semantic->name].push_back(*semantic->set);
      const auto accessor = read_reference(value, accessors_.size(), "accessor");
      if (!accessor) return;
      const Accessor& a = accessors_[*accessor];
      if (!count) count = a.count;
      if (a.count != *count) {
        value.error("The attributes of a primitive have the same number of elements: this one has " +
                    std::to_string(a.count) + ", an earlier one " + std::to_string(*count) + ".");
        return;
      }
      if (!a.is_known) return;
      if (a.type == ComponentType::uint32) {
        value.error("No attribute has components of 32-bit integers.");
        return;
      }
      check_place(*accessor, value);
      take_attribute(*semantic, *accessor, value, p);
    });
    for (auto& [name, numbers] : sets) {
      std::ranges::sort(numbers);
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        if (numbers[i] == i) continue;
        attributes.value().error("The sets of " + std::string(name) + " are numbered from 0 on without a gap.");
        break;
      }
    }
    if (sets["JOINTS"].size() != sets["WEIGHTS"].size())
      attributes.value().error("There are as many sets of JOINTS as of WEIGHTS.");
    if (sets["TEXCOORD"].size() > 2) file_.note(attributes.value(), "Texture coordinates beyond two sets are ignored");
    if (sets["COLOR"].size() > 1) file_.note(attributes.value(), "Vertex colours beyond the first set are ignored");
    if (sets["JOINTS"].size() > 1) file_.note(attributes.value(), "Joints beyond four for a vertex are ignored");
  }

  /// Alignment, stride, and that the view is one of vertex attributes.
  void check_place(std::uint32_t accessor, const JsonCursor& where) {
    const Accessor& a = accessors_[accessor];
    if (!a.view) return;
    if (a.offset % 4 != 0 || a.stride % 4 != 0 || buffers_.view(*a.view).offset % 4 != 0) {
      where.error("Vertex attributes begin at multiples of 4 bytes, and every vertex' does.");
    }
    buffers_.use(*a.view, ViewUse::vertices, where);
    const auto [user, is_first] = users_.try_emplace(*a.view, accessor);
    if (!is_first && user->second != accessor && !buffers_.view(*a.view).stride) {
      where.error("Buffer view " + std::to_string(*a.view) +
                  " holds several attributes, so it needs a \"byteStride\".");
    }
  }

  void take_attribute(const Semantic& semantic, std::uint32_t accessor, const JsonCursor& where, Primitive& p) {
    const Accessor& a = accessors_[accessor];
    const auto take = [&](std::optional<std::uint32_t>& attribute, bool is_allowed) {
      if (is_allowed) attribute = accessor;
      if (!is_allowed)
        where.error("Accessor " + std::to_string(accessor) + " has a type that this attribute can't have.");
    };
    const std::uint32_t components = a.is_matrix ? 0 : a.components;
    const std::uint32_t set = semantic.set.value_or(0);
    if (semantic.name == "POSITION") {
      take(p.position, components == 3 && (is_float(a) || (is_quantized_ && is_short_integer(a))));
      if (!a.has_bounds) where.error("The accessor of positions needs \"min\" and \"max\".");
    } else if (semantic.name == "NORMAL") {
      take(p.normal, components == 3 && (is_float(a) || (is_quantized_ && is_signed_fraction(a))));
    } else if (semantic.name == "TANGENT") {
      take(p.tangent, components == 4 && (is_float(a) || (is_quantized_ && is_signed_fraction(a))));
    } else if (semantic.name == "TEXCOORD") {
      std::optional<std::uint32_t> beyond;
      take(set < p.uvs.size() ? p.uvs[set] : beyond,
           components == 2 && (is_float(a) || is_fraction(a) || (is_quantized_ && is_short_integer(a))));
    } else if (semantic.name == "COLOR") {
      std::optional<std::uint32_t> beyond;
      take(set == 0 ? p.color : beyond, (components == 3 || components == 4) && (is_float(a) || is_fraction(a)));
    } else if (semantic.name == "JOINTS" && set == 0) {
      take(p.joints,
           components == 4 && !a.is_normalized && (a.type == ComponentType::uint8 || a.type == ComponentType::uint16));
    } else if (semantic.name == "WEIGHTS" && set == 0) {
      take(p.weights, components == 4 && (is_float(a) || is_fraction(a)));
    }
  }

  bool check_indices(const Accessor& a, const JsonCursor& where) {
    if (!a.is_known) return true;
    const bool is_unsigned =
        a.type == ComponentType::uint8 || a.type == ComponentType::uint16 || a.type == ComponentType::uint32;
    if (a.components != 1 || !is_unsigned || a.is_normalized)
      return where.error("Indices are scalars of an unsigned integer type, not normalised.");
    return !a.view || buffers_.use(*a.view, ViewUse::indices, where);
  }

  /// The number of morph targets.
  std::size_t check_targets(const GltfObject& primitive) {
    const auto targets = primitive.array("targets");
    if (targets.empty()) return 0;
    std::map<std::string_view, JsonCursor> attributes;
    if (const auto own = primitive.object("attributes"))
      own->value().each_member([&](std::string_view name, JsonCursor value) { attributes.emplace(name, value); });
    for (const JsonCursor& target : targets) {
      if (target.kind() != JsonKind::object || target.size() == 0) {
        target.expected("an object of at least one attribute");
        continue;
      }
      target.each_member([&](std::string_view name, JsonCursor value) { check_target(attributes, name, value); });
    }
    return targets.size();
  }

  void check_target(const std::map<std::string_view, JsonCursor>& attributes, std::string_view name,
                    const JsonCursor& value) {
    if (!semantic_of(name)) {
      value.error("glTF has no attribute of that name; an application's own begin with \"_\".");
      return;
    }
    const auto accessor = read_reference(value, accessors_.size(), "accessor");
    const auto own = attributes.find(name);
    if (own == attributes.end()) {
      value.error("The primitive itself has no such attribute.");
      return;
    }
    const JsonCursor& base = own->second;
    const auto base_accessor = base.is_number() && base.number() >= 0 && base.number() < double(accessors_.size())
                                   ? std::optional(static_cast<std::uint32_t>(base.number()))
                                   : std::nullopt;
    if (!accessor || !base_accessor) return;
    const Accessor& a = accessors_[*accessor];
    if (a.count != accessors_[*base_accessor].count)
      value.error("The primitive's own attribute has another number of elements.");
    if (name == "POSITION" && !a.has_bounds) value.error("The accessor of positions needs \"min\" and \"max\".");
    if (a.is_known) check_place(*accessor, value);
  }

  std::optional<DracoPrimitive> read_draco(const GltfObject& object) {
    const auto extension = object.extension("KHR_draco_mesh_compression");
    if (!extension) return std::nullopt;
    DracoPrimitive draco{.where = extension->value(), .view = 0, .ids = {}};
    extension->required("attributes");
    const auto view = read_reference(extension->required("bufferView"), buffers_.views(), "buffer view");
    const auto attributes = extension->object("attributes");
    if (!view || !attributes) return std::nullopt;
    draco.view = *view;
    attributes->value().each_member([&](std::string_view name, JsonCursor value) {
      std::uint32_t id = 0;
      if (read(value, id, 0, UINT32_MAX) && std::ranges::find(kReadAttributes, name) != std::end(kReadAttributes))
        draco.ids.emplace(name, id);
    });
    buffers_.use(*view, ViewUse::other, extension->value());
    return draco;
  }

  std::optional<std::uint32_t> read_material(const GltfObject& object, const Primitive& p) {
    const auto own = object.find("material");
    auto material = read_reference(own, materials_.size(), "material");
    check_uvs(own, material, p);
    const auto variants = object.extension("KHR_materials_variants");
    if (!variants) return material;
    for (const JsonCursor& element : variants->array("mappings")) {
      const GltfObject mapping(element);
      const auto field = mapping.required("material");
      const auto mapped = read_reference(field, materials_.size(), "material");
      check_uvs(field, mapped, p);
      for (const JsonCursor& number : mapping.array("variants")) {
        std::uint32_t at = 0;
        if (read(number, at, 0, UINT32_MAX) && mapped && variant_ && at == *variant_) material = mapped;
      }
    }
    return material;
  }

  void check_uvs(const std::optional<JsonCursor>& field, std::optional<std::uint32_t> material, const Primitive& p) {
    for (std::size_t set = 0; material && set < p.uvs.size(); ++set) {
      if (materials_[*material][set] && !p.uvs[set] && p.is_surface()) {
        field->error("The material's textures use TEXCOORD_" + std::to_string(set) +
                     ", which the primitive doesn't have.");
      }
    }
  }

  GltfFile& file_;
  GltfBuffers& buffers_;
  const Accessors& accessors_;
  const UsedUvs& materials_;
  std::optional<std::uint32_t> variant_;
  bool is_quantized_ = false;
  std::map<std::uint32_t, std::uint32_t> users_;  ///< Of views without a stride: the first accessor of attributes.
};

}  // namespace

std::vector<GltfMesh> read_meshes(GltfFile& file, GltfBuffers& buffers, const Accessors& accessors,
                                  const UsedUvs& materials, std::optional<std::uint32_t> variant) {
  MeshReader reader(file, buffers, accessors, materials, variant);
  std::vector<GltfMesh> meshes;
  for (const JsonCursor& mesh : file.root().array("meshes")) meshes.push_back(reader.read_mesh(GltfObject(mesh)));
  return meshes;
}

}  // namespace tessera::proto
