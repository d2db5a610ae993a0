#include "proto/import/gltf/extensions.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tessera::proto {
namespace {

constexpr std::string_view kKnown[] = {
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
};
static_assert(std::ranges::is_sorted(kKnown));

/// "2.1": whole numbers with a point between them.
std::optional<std::pair<std::uint32_t, std::uint32_t>> version_of(std::string_view text) {
  std::pair<std::uint32_t, std::uint32_t> version;
  const char* const end = text.data() + text.size();
  const auto major = std::from_chars(text.data(), end, version.first);
  if (major.ec != std::errc() || major.ptr == end || *major.ptr != '.') return std::nullopt;
  const auto minor = std::from_chars(major.ptr + 1, end, version.second);
  if (minor.ec != std::errc() || minor.ptr != end) return std::nullopt;
  return version;
}

std::optional<std::pair<std::uint32_t, std::uint32_t>> read_version(const std::optional<JsonCursor>& field) {
  if (!field) return std::nullopt;
  const auto version = field->kind() == JsonKind::string ? version_of(field->string()) : std::nullopt;
  if (!version) field->expected("a version such as \"2.0\"");
  return version;
}

/// The strings of an array, sorted, without those that stand there twice, which is an error.
std::vector<JsonCursor> names_in(const GltfObject& root, std::string_view member) {
  std::vector<JsonCursor> names = root.array(member);
  std::erase_if(names, [](const JsonCursor& name) {
    return name.kind() != JsonKind::string && !name.expected("the name of an extension");
  });
  std::ranges::stable_sort(names, {}, &JsonCursor::string);
  for (std::size_t i = 1; i < names.size(); ++i)
    if (names[i].string() == names[i - 1].string()) names[i].error("The extension is named twice.");
  return names;
}

}  // namespace

void check_asset(GltfFile& file) {
  const GltfObject root = file.root();
  root.required("asset");
  if (const auto asset = root.object("asset")) {
    const auto field = asset->required("version"), least_field = asset->find("minVersion");
    const auto version = read_version(field), least = read_version(least_field);
    if (version && version->first != 2) field->error("Only glTF 2.x is read, not " + in_quotes(field->string()) + ".");
    if (least && version && *least > *version) {
      least_field->error("\"minVersion\" is greater than \"version\".");
    } else if (least && *least > std::pair(2U, 0U)) {
      file.note(*least_field, "The file asks for a later glTF than 2.0, and is read as 2.0");
    }
  }
  const auto used = names_in(root, "extensionsUsed");
  for (const JsonCursor& name : names_in(root, "extensionsRequired")) {
    if (!std::ranges::binary_search(kKnown, name.string())) {
      name.error("The file requires the extension " + in_quotes(name.string()) + ", which isn't known here.");
    } else if (!std::ranges::binary_search(used, name.string(), {}, &JsonCursor::string)) {
      name.error("A required extension is named in \"extensionsUsed\", too.");
    }
  }
  std::string unknown;
  std::uint64_t count = 0;
  constexpr std::uint64_t kMostNames = 8;
  for (const JsonCursor& name : used) {
    if (std::ranges::binary_search(kKnown, name.string())) continue;
    if (++count <= kMostNames) unknown += (count == 1 ? "" : ", ") + in_quotes(name.string());
  }
  if (count > kMostNames) unknown += " and others";
  if (count > 0) file.note(*root.find("extensionsUsed"), "Extensions that aren't known here are ignored: " + unknown);
  if (const auto animations = root.array("animations"); !animations.empty())
    file.note(*root.find("animations"), "Animations aren't played: all stands as the file puts it at first");
}

}  // namespace tessera::proto
