#include "proto/import/mtl.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "proto/import/broken_file.h"
#include "proto/import/import_notes.h"
#include "proto/import/numbers.h"
#include "proto/import/obj_text.h"
#include "proto/import/read_file.h"
#include "proto/import/text_cursor.h"

namespace tessera::proto {
namespace {

/// A material takes some 200 bytes with its name, and as little as 9 in the file.
constexpr std::size_t kMostMaterials = 1 << 16;

float not_negative(float value) { return value > 0 && std::isfinite(value) ? value : 0; }

/// A material as MTL describes it (Wavefront, "Advanced Visualizer Manual", 1995, appendix B).
struct MtlMaterial {
  std::string name;
  Rgb kd{0, 0, 0}, ks{0, 0, 0};
  float ns = 1, ni = 1, tr = 0;
  std::optional<float> d;  ///< Without it opacity is 1 − tr.
  int illum = 0;
  bool has_texture = false;  ///< For kd.
};

bool is_texture(std::string_view keyword) {
  return keyword.starts_with("map_") || keyword == "bump" || keyword == "disp" || keyword == "decal" ||
         keyword == "refl" || keyword == "norm";
}

class MtlReader {
 public:
  MtlReader(std::string text, std::string_view file_name, ImportNotes& notes)
      : text_(std::move(text), file_name), notes_(notes) {}

  /// The library's materials that have names; nothing when there are more than `kMostMaterials`.
  std::vector<MtlMaterial> read() {
    while (text_.next()) {
      read_line();
      if (materials_.size() <= kMostMaterials + 1) continue;
      notes_.add("A library of more than " + std::to_string(kMostMaterials) + " materials was ignored");
      return {};
    }
    std::erase_if(materials_, [](const MtlMaterial& m) { return m.name.empty(); });
    return std::move(materials_);
  }

 private:
  void read_line() {
    TextCursor words(text_.current(), '#');
    const std::string_view keyword = words.next();
    MtlMaterial& material = materials_.back();
    if (keyword == "newmtl") {
      materials_.emplace_back().name = trimmed(words.rest());
    } else if (keyword == "Kd") {
      material.kd = color(words);
    } else if (keyword == "Ks") {
      material.ks = color(words);
    } else if (keyword == "Ns") {
      material.ns = numbers<1>(words)[0];
    } else if (keyword == "Ni") {
      material.ni = numbers<1>(words)[0];
    } else if (keyword == "d") {
      material.d = numbers<1>(words)[0];
    } else if (keyword == "Tr") {
      material.tr = numbers<1>(words)[0];
    } else if (keyword == "illum") {
      material.illum = static_cast<int>(std::clamp(numbers<1>(words)[0], 0.0F, 100.0F));
    } else if (is_texture(keyword)) {
      notes_.add("Textures aren't read: a texture was ignored", text_.line());
      material.has_texture |= keyword == "map_Kd";
    }
  }

  template <std::size_t n>
  std::array<float, n> numbers(TextCursor& words) {
    std::array<float, n> values{};
    bool are_good = true;
    for (float& value : values) {
      const std::optional<float> number = parse_float(words.next());
      const bool is_good = number && std::isfinite(*number);
      if (is_good) value = *number;
      are_good &= is_good;
    }
    if (!are_good) notes_.add("A number is missing, or isn't one, and counts as 0", text_.line());
    return values;
  }

  Rgb color(TextCursor& words) {
    const auto [r, g, b] = numbers<3>(words);
    return {not_negative(r), not_negative(g), not_negative(b)};
  }

  ObjText text_;
  ImportNotes& notes_;
  std::vector<MtlMaterial> materials_{1};  ///< What stands before the first name belongs to a material without one.
};

/// MTL's illumination models in Whitted's terms. A file without `illum` has model 0, and counts as 2, highlights on.
Material to_material(const MtlMaterial& mtl) {
  const float opacity = std::min(not_negative(mtl.d.value_or(1 - mtl.tr)), 1.0F);
  const bool is_traced = mtl.illum >= 3 && mtl.illum <= 7;
  const bool refracts = mtl.illum >= 4 && mtl.illum != 8;
  Material material;
  material.diffuse = mtl.kd * opacity;
  // A colour of 0 under a texture, as many exporters write, would be black without it.
  if (material.diffuse.is_black() && mtl.has_texture) material.diffuse = Rgb{0.6F, 0.6F, 0.6F} * opacity;
  if (mtl.illum != 1) material.specular = mtl.ks;
  material.shininess = not_negative(mtl.ns);
  if (is_traced) material.reflect = mtl.ks;
  material.transmit = Rgb{1, 1, 1} * (1 - opacity);
  if (refracts && mtl.ni > 0) material.ior = mtl.ni;
  material.fresnel = mtl.illum == 5 || mtl.illum == 7;
  return material;
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") + 1 - begin);
}

bool MtlLibraries::load(std::string_view arguments) {
  can_read_all_ = true;
  return search_.look_for(arguments) && can_read_all_;
}

bool MtlLibraries::load_file(const std::string& name) {
  const std::optional<std::filesystem::path> file = companions_ ? companions_(name) : std::nullopt;
  if (!file) return false;
  try {
    std::string text = read_file(*file, name, kLargestFile);
    if (text.size() > bytes_left_) throw BrokenFile{{{name, "The libraries before this one are too large together"}}};
    bytes_left_ -= text.size();
    load_text(std::move(text), name);
  } catch (const BrokenFile& broken) {
    for (const FieldError& error : broken.errors) warnings.push_back({error.pointer, error.detail});
    can_read_all_ = false;
  }
  return true;
}

void MtlLibraries::load_text(std::string text, std::string_view name) {
  ImportNotes notes(name);
  const std::vector<MtlMaterial> loaded = MtlReader(std::move(text), name, notes).read();
  const std::vector<SceneWarning> noted = notes.warnings();
  warnings.insert(warnings.end(), noted.begin(), noted.end());
  for (const MtlMaterial& mtl : loaded) {
    by_name_.emplace(mtl.name, static_cast<std::uint32_t>(materials.size()));
    materials.push_back(to_material(mtl));
  }
}

std::optional<std::uint32_t> MtlLibraries::find(std::string_view name) const {
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace tessera::proto
