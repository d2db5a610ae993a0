#include "proto/import/mtl.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <istream>
#include <utility>

#include <tiny_obj_loader.h>

#include "proto/import/broken_file.h"
#include "proto/import/import_notes.h"
#include "proto/import/numbers.h"
#include "proto/import/obj_text.h"
#include "proto/import/read_file.h"
#include "proto/import/text_cursor.h"

namespace tessera::proto {
namespace {

/// tinyobjloader keeps about 2 KiB for a material, which may be as short as "newmtl a".
constexpr std::size_t kMostMaterials = 1 << 16;

struct Statement {
  std::string_view keyword;
  int numbers;
};
constexpr std::array kNumberStatements{Statement{"Kd", 3}, Statement{"Ks", 3}, Statement{"Ns", 1},   Statement{"Ni", 1},
                                       Statement{"d", 1},  Statement{"Tr", 1}, Statement{"illum", 1}};

bool is_texture(std::string_view keyword) {
  return keyword.starts_with("map_") || keyword == "bump" || keyword == "disp" || keyword == "decal" ||
         keyword == "refl" || keyword == "norm";
}

/// Names the lines that the loader would misread: it takes what is no number for 0. Counts the materials.
std::size_t check_lines(std::string_view text, ImportNotes& notes) {
  std::size_t materials = 0;
  TextCursor words(text, '#');
  for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
    if (word == "newmtl") ++materials;
    if (is_texture(word)) notes.add("Textures aren't read: a texture was ignored", words.line());
    const auto* statement = std::find_if(kNumberStatements.begin(), kNumberStatements.end(),
                                         [&](const Statement& s) { return s.keyword == word; });
    for (int i = 0; statement != kNumberStatements.end() && i < statement->numbers; ++i) {
      const std::optional<float> number = parse_float(words.next_on_line());
      if (!number || !std::isfinite(*number)) {
        notes.add("A number is missing, or isn't one, and counts as 0", words.line());
        break;
      }
    }
    while (!words.next_on_line().empty()) continue;
  }
  return materials;
}

float not_negative(float value) { return value > 0 && std::isfinite(value) ? value : 0; }

Rgb color(const tinyobj::real_t (&c)[3]) { return {not_negative(c[0]), not_negative(c[1]), not_negative(c[2])}; }

/// MTL's illumination models (Wavefront 1995) in Whitted's terms. A file without `illum` has model 0 from the
/// loader, and counts as 2, highlights on.
Material to_material(const tinyobj::material_t& mtl) {
  const float opacity = std::min(not_negative(mtl.dissolve), 1.0F);
  const bool is_traced = mtl.illum >= 3 && mtl.illum <= 7;
  const bool refracts = mtl.illum >= 4 && mtl.illum != 8;
  Material material;
  material.diffuse = color(mtl.diffuse) * opacity;
  // A colour of 0 under a texture, as many exporters write, would be black without it.
  if (material.diffuse.is_black() && !mtl.diffuse_texname.empty()) material.diffuse = Rgb{0.6F, 0.6F, 0.6F} * opacity;
  if (mtl.illum != 1) material.specular = color(mtl.specular);
  material.shininess = not_negative(mtl.shininess);
  if (is_traced) material.reflect = color(mtl.specular);
  material.transmit = Rgb{1, 1, 1} * (1 - opacity);
  if (refracts && mtl.ior > 0 && std::isfinite(mtl.ior)) material.ior = mtl.ior;
  material.fresnel = mtl.illum == 5 || mtl.illum == 7;
  return material;
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") + 1 - begin);
}

bool MtlLibraries::load(std::string_view names) {
  std::vector<std::string_view> words;
  TextCursor cursor(names, TextCursor::kNoComment);
  for (std::string_view word = cursor.next(); !word.empty() && words.size() < kMostLookedFor; word = cursor.next()) {
    words.push_back(word);
  }
  bool all_found = !words.empty();
  for (std::size_t first = 0, taken = 0; first < words.size(); first += std::max<std::size_t>(taken, 1)) {
    // The longest name first: "box red.mtl" is a file rather than two.
    for (taken = words.size() - first; taken > 0; --taken) {
      const char* begin = words[first].data();
      const std::string_view last = words[first + taken - 1];
      if (load_file({begin, last.data() + last.size()})) break;
    }
    all_found &= taken > 0;
  }
  return all_found;
}

bool MtlLibraries::load_file(const std::string& name) {
  const auto known = looked_for_.find(name);
  if (known != looked_for_.end()) return known->second;
  if (looked_for_.size() >= kMostLookedFor) return false;
  bool& loaded = looked_for_[name] = false;

  // Backslashes are Windows' slashes, or stand before the blanks of a name.
  std::string path;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (name[i] != '\\') {
      path += name[i];
    } else if (i + 1 == name.size() || name[i + 1] != ' ') {
      path += '/';
    }
  }
  const std::optional<std::filesystem::path> file = companions_ ? companions_(path) : std::nullopt;
  if (!file) return false;
  try {
    loaded = load_text(read_file(*file, name, kLargestFile), name);
  } catch (const BrokenFile& broken) {
    for (const FieldError& error : broken.errors) warnings.push_back({error.pointer, error.detail});
  }
  return loaded;
}

bool MtlLibraries::load_text(std::string text, std::string_view name) {
  ImportNotes notes(name);
  const bool fits = check_lines(text, notes) <= kMostMaterials;
  if (!fits) notes.add("A library of more than " + std::to_string(kMostMaterials) + " materials was ignored");
  const std::vector<SceneWarning> noted = notes.warnings();
  warnings.insert(warnings.end(), noted.begin(), noted.end());
  if (!fits) return false;

  ObjText buffer(std::move(text), name);
  std::istream stream(&buffer);
  std::map<std::string, int> indices;
  std::vector<tinyobj::material_t> loaded;
  std::string warning, error;
  tinyobj::LoadMtl(&indices, &loaded, &stream, &warning, &error);

  const auto first = static_cast<std::uint32_t>(materials.size());
  for (const tinyobj::material_t& mtl : loaded) materials.push_back(to_material(mtl));
  for (const auto& [key, index] : indices) {
    by_name_.emplace(trimmed(key), first + static_cast<std::uint32_t>(index));
  }
  return true;
}

std::optional<std::uint32_t> MtlLibraries::find(std::string_view name) const {
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace tessera::proto
