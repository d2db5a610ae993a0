#include "proto/import/mtl.h"

#include <algorithm>
#include <array>
#include <cctype>
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

/// Far beyond any use; the products of what is smaller stay finite.
constexpr float kLargestMtlShare = 1000;

/// A material takes some 200 bytes with its name, and as little as 9 in the file.
constexpr std::size_t kMostMaterials = 1 << 16;

/// Where a ball is seen, N·v is 2/3 on average over its picture.
constexpr float kMeanFacing = 2.0F / 3;

}  // namespace

/// A material as MTL describes it.
struct MtlMaterial {
  std::string name;
  std::size_t line = 0;
  Rgb kd{0, 0, 0};
  std::optional<Rgb> ks, tf;
  float ns = 1, ni = 1;
  std::optional<float> d, tr;
  int illum = 2;
  std::size_t tf_line = 0;
  Rgb ke{};
  std::optional<float> pr, pm, ps, pc, pcr;
  bool is_physical = false;   ///< Whether it has one of these, or a map of one, there or not,
  bool names_kd_map = false;  ///< and a map_Kd.
  std::vector<MtlMap> maps;   ///< One of each slot.

  float opacity() const { return d ? *d : 1 - tr.value_or(0); }
  bool refracts() const { return illum == 6 || illum == 7; }
};

namespace {

/// Known statements without a meaning here, in lower case, and what to call them. The last ones are the physically
/// based extension (Boubekeur & Harris 2016).
constexpr std::array<std::pair<std::string_view, std::string_view>, 17> kWithoutMeaning{{
    {"ka", "Ka (an ambient colour of its own)"},
    {"map_ka", "map_Ka (a texture of an ambient colour)"},
    {"map_ns", "map_Ns (a texture of shininess)"},
    {"map_tr", "map_Tr (a texture of transparency)"},
    {"map_tf", "map_Tf (a texture of a filter's colour)"},
    {"disp", "disp (displacement)"},
    {"map_disp", "map_disp (displacement)"},
    {"decal", "decal (a texture above others)"},
    {"map_decal", "map_decal (a texture above others)"},
    {"refl", "refl (a reflection map)"},
    {"km", "Km (a bump's height)"},
    {"sharpness", "sharpness (of a reflection map)"},
    {"map_aat", "map_aat (smoothing of textures)"},
    {"aniso", "aniso (anisotropy)"},
    {"anisor", "anisor (its rotation)"},
    {"mapping", "mapping"},
    {"reflectivity", "reflectivity"},
}};

/// CIE XYZ to linear sRGB (IEC 61966-2-1).
Rgb rgb_of_xyz(std::array<float, 3> c) {
  const auto [x, y, z] = c;
  return {3.2406F * x - 1.5372F * y - 0.4986F * z, -0.9689F * x + 1.8758F * y + 0.0415F * z,
          0.0557F * x - 0.2040F * y + 1.0570F * z};
}

class MtlReader {
 public:
  MtlReader(std::string text, std::string_view file_name, MtlTextures& textures, ImportNotes& notes,
            std::stop_token stop)
      : steps_(std::move(stop)),
        text_(std::move(text), file_name, steps_),
        file_name_(file_name),
        textures_(textures),
        notes_(notes) {}

  /// The library's materials that have names; nothing when there are more than `kMostMaterials`.
  std::vector<MtlMaterial> read() {
    while (text_.next()) {
      steps_.take();
      read_line();
      if (materials_.size() <= kMostMaterials) continue;
      notes_.add("A library of more than " + std::to_string(kMostMaterials) + " materials was ignored");
      return {};
    }
    std::erase_if(materials_, [](const MtlMaterial& m) { return m.name.empty(); });
    return std::move(materials_);
  }

 private:
  void read_line() {
    if (read_map()) return;
    TextCursor words(text_.current(), '#');
    const std::string keyword = lower_case(words.next());
    if (keyword.empty()) return;
    if (keyword == "newmtl") return start_material(trimmed(words.rest()));
    if (materials_.empty()) return note("A statement before the first newmtl was ignored");
    MtlMaterial& material = materials_.back();
    if (keyword == "kd") {
      material.kd = color(words);
    } else if (keyword == "ks") {
      material.ks = color(words);
    } else if (keyword == "tf") {
      material.tf = color(words);
      material.tf_line = text_.line();
    } else if (keyword == "ns") {
      material.ns = not_negative(number(words.next()));
    } else if (keyword == "ni") {
      read_ni(words);
    } else if (keyword == "d") {
      read_d(words);
    } else if (keyword == "tr") {
      material.tr = fraction(words.next());
    } else if (keyword == "illum") {
      read_illum(words);
    } else if (keyword == "ke") {
      material.ke = light(words);
    } else if (std::optional<float>* const number = physical(keyword)) {
      *number = fraction(words.next());
      material.is_physical = true;
    } else {
      return note_ignored(keyword);
    }
    if (!words.next().empty()) note("What follows the numbers of a statement was ignored");
  }

  /// Whether the line names a texture that is read. A # may be a part of its name.
  bool read_map() {
    TextCursor words(text_.current(), TextCursor::kNoComment);
    const std::string keyword = lower_case(words.next());
    if (std::ranges::find(kTextureKeywords, keyword) == std::end(kTextureKeywords)) return false;
    if (materials_.empty()) return note("A statement before the first newmtl was ignored"), true;
    MtlMaterial& material = materials_.back();
    material.names_kd_map |= keyword == "map_kd";
    material.is_physical |= keyword.starts_with("map_p");
    if (auto map = textures_.read(file_name_, keyword, words.rest(), notes_, text_.line())) {
      std::erase_if(material.maps, [&](const MtlMap& other) { return other.slot == map->slot; });
      material.maps.push_back(*std::move(map));
    }
    return true;
  }

  /// What a statement of the physically based extension sets; null for others.
  std::optional<float>* physical(std::string_view keyword) {
    MtlMaterial& material = materials_.back();
    if (keyword == "pr") return &material.pr;
    if (keyword == "pm") return &material.pm;
    if (keyword == "ps") return &material.ps;
    if (keyword == "pc") return &material.pc;
    if (keyword == "pcr") return &material.pcr;
    return nullptr;
  }

  void note(std::string_view what) { notes_.add(what, text_.line()); }

  void start_material(std::string_view name) {
    if (name.empty()) note("A material without a name was ignored");
    MtlMaterial& material = materials_.emplace_back();
    material.name = name;
    material.line = text_.line();
  }

  /// Names statements in our own words alone: the file may be any file.
  void note_ignored(std::string_view keyword) {
    const auto* known = std::ranges::find(kWithoutMeaning, keyword, [](const auto& entry) { return entry.first; });
    if (known == kWithoutMeaning.end() && keyword.starts_with("map_"))
      return note("A texture of another kind was ignored");
    if (known == kWithoutMeaning.end()) return note("A statement that MTL doesn't have was ignored");
    note(std::string(known->second) + " has no meaning here and was ignored");
  }

  float number(std::string_view word) {
    const std::optional<float> value = parse_float(word);
    if (value && std::isfinite(*value)) return *value;
    note("A number is missing, or isn't one, and counts as 0");
    return 0;
  }

  float not_negative(float value) {
    if (value < 0) note("A negative number counts as 0");
    return std::max(value, 0.0F);
  }

  float fraction(std::string_view word) {
    const float value = number(word);
    if (value < 0 || value > 1) note("A number beyond the range from 0 to 1 counts as its nearest end");
    return std::clamp(value, 0.0F, 1.0F);
  }

  void read_ni(TextCursor& words) {
    const float value = number(words.next());
    if (!(value > 0)) return note("An index of refraction that isn't above 0 was ignored");
    materials_.back().ni = value;
  }

  void read_d(TextCursor& words) {
    const std::string word = lower_case(words.next());
    if (word != "-halo") {
      materials_.back().d = fraction(word);
      return;
    }
    // The specification: dissolve = 1 − (N·v)(1 − factor).
    materials_.back().d = 1 - kMeanFacing * (1 - fraction(words.next()));
    note("d -halo is the same from everywhere: it is taken as its mean over a ball");
  }

  void read_illum(TextCursor& words) {
    const std::optional<int> model = parse_integer<int>(words.next());
    if (!model || *model < 0 || *model > 10)
      return note("An illumination model that isn't a whole number from 0 to 10 was ignored");
    if (*model == 0) note("illum 0 (a colour that light doesn't change) is rendered as illum 1");
    if (*model == 10) note("illum 10 (only shadows are seen) is rendered as illum 2");
    materials_.back().illum = *model;
  }

  Rgb color(TextCursor& words) {
    const Rgb value = any_color(words);
    if (largest(value) > kLargestMtlShare)
      note("A colour has a component above 1000, which counts as 1000");
    else if (largest(value) > 1)
      note("A colour has a component above 1, which is used as it is");
    return at_most(kLargestMtlShare, value);
  }

  Rgb light(TextCursor& words) { return at_most(kLargestLight, any_color(words)); }

  Rgb at_most(float most, Rgb value) {
    const auto share = [&](float v) { return std::min(not_negative(v), most); };
    return {share(value.r), share(value.g), share(value.b)};
  }

  Rgb any_color(TextCursor& words) {
    const TextCursor begin = words;
    const std::string first = lower_case(words.next());
    if (first == "spectral") return spectral(words);
    if (first == "xyz") return rgb_of_xyz(components(words));
    words = begin;
    const auto [r, g, b] = components(words);
    return {r, g, b};
  }

  /// One number stands for all three.
  std::array<float, 3> components(TextCursor& words) {
    const float first = number(words.next());
    std::array<float, 3> values{first, first, first};
    const std::string_view second = words.next();
    if (second.empty()) return values;
    values[1] = number(second);
    const std::string_view third = words.next();
    if (third.empty()) {
      note("A colour has two numbers: the third is taken to equal the first");
    } else {
      values[2] = number(third);
    }
    return values;
  }

  /// file.rfl [factor]; the name may hold blanks.
  Rgb spectral(TextCursor& words) {
    std::string_view last;
    int count = 0;
    for (std::string_view word = words.next(); !word.empty(); word = words.next(), ++count) last = word;
    note("Spectral curves aren't read: a grey of the curve's factor is used");
    const std::optional<float> factor = count > 1 ? parse_float(last) : std::nullopt;
    const float grey = factor && std::isfinite(*factor) ? *factor : 1;
    return {grey, grey, grey};
  }

  Steps steps_;
  ObjText text_;
  std::string_view file_name_;
  MtlTextures& textures_;
  ImportNotes& notes_;
  std::vector<MtlMaterial> materials_;
};

Rgb not_reflected(Rgb ks) { return {std::max(1 - ks.r, 0.0F), std::max(1 - ks.g, 0.0F), std::max(1 - ks.b, 0.0F)}; }

/// A colour of 0 under a texture, as many programs write it, would be black.
Rgb under_map(Rgb color, bool has_map) { return has_map && color.is_black() ? Rgb{1, 1, 1} : color; }
float under_map(std::optional<float> number, bool has_map) {
  return has_map && number.value_or(0) == 0 ? 1 : number.value_or(0);
}

/// MTL's illumination models in Whitted's terms. What `mtl` doesn't stop goes through, but for what `alpha` says.
WhittedSurface to_whitted(const MtlMaterial& mtl, Rgb kd, Rgb ks, bool has_alpha_map, ImportNotes& notes) {
  const float opacity = has_alpha_map ? 1 : mtl.opacity();
  const bool has_fresnel = mtl.illum == 5 || mtl.illum == 7;
  WhittedSurface surface;
  surface.diffuse = kd * opacity;
  if (mtl.illum > 1) surface.specular = ks;
  surface.shininess = mtl.ns;
  if (mtl.illum >= 3 && mtl.illum <= 7) surface.reflect = ks;
  surface.transmit = Rgb{1, 1, 1} * (1 - opacity);
  if (mtl.tf) {
    if (mtl.refracts()) surface.transmit = surface.transmit + not_reflected(ks) * opacity;
    if (surface.transmit.is_black()) notes.add("Tf without illum 6 or 7, or a d below 1, has no effect", mtl.tf_line);
    surface.transmit = surface.transmit * *mtl.tf;
  }
  if (mtl.refracts() || has_fresnel) surface.ior = mtl.ni;
  // Between media of one index nothing is reflected; MTL's own formula starts from Ks.
  surface.fresnel = has_fresnel && mtl.ni != 1;
  if (has_fresnel && !surface.fresnel)
    notes.add("illum 5 or 7 without an Ni other than 1 reflects as 3 or 6", mtl.line);
  return surface;
}

/// Of which Phong's highlight looks alike, where no roughness is given: α² = 2 / (n + 2) (Walter et al. 2007).
float roughness_of(float shininess) { return std::sqrt(std::sqrt(2 / (shininess + 2))); }

/// The extension says nothing of how sheen is spread.
constexpr float kSheenRoughness = 0.5F;

template <typename HasMap>
Surface to_physical(const MtlMaterial& mtl, Rgb base_color, const HasMap& has_map) {
  Layered surface;
  surface.base_color = base_color;
  surface.metallic = under_map(mtl.pm, has_map(TextureSlot::metallic));
  surface.roughness = mtl.pr || has_map(TextureSlot::roughness) ? under_map(mtl.pr, has_map(TextureSlot::roughness))
                                                                : roughness_of(mtl.ns);
  const float sheen = under_map(mtl.ps, has_map(TextureSlot::sheen_color));
  surface.sheen_color = {sheen, sheen, sheen};
  surface.sheen_roughness = kSheenRoughness;
  surface.clearcoat = under_map(mtl.pc, has_map(TextureSlot::clearcoat));
  surface.clearcoat_roughness = under_map(mtl.pcr, has_map(TextureSlot::clearcoat_roughness));
  if (mtl.refracts() && mtl.tf) {
    surface.transmission = std::min(static_cast<float>(mean(*mtl.tf)), 1.0F);
    surface.thin = false;
    surface.ior = std::max(mtl.ni, 1.0F);
  }
  if (sheen > 0 || surface.clearcoat > 0 || surface.transmission > 0) return surface;
  return MetallicRoughness{surface.base_color, surface.metallic, surface.roughness};
}

/// Not for highlights that there are none of.
bool has_effect(const MtlMap& map, const MtlMaterial& mtl, ImportNotes& notes) {
  if (map.slot != TextureSlot::specular_color) return true;
  const bool has_highlight = !mtl.is_physical && mtl.illum > 1 && !(mtl.ks && mtl.ks->is_black());
  if (!has_highlight)
    notes.add("map_Ks has no effect with a Ks of 0, with illum 0 or 1, or beside the physically based extension",
              map.line);
  return has_highlight;
}

/// With the textures that can be had.
Material to_material(const MtlMaterial& mtl, std::vector<TextureUse> uses, ImportNotes& notes) {
  if (mtl.d && mtl.tr && std::abs(*mtl.d - (1 - *mtl.tr)) > 0.01F) notes.add("Tr isn't 1 - d: d is used", mtl.line);
  Material material;
  material.textures = std::move(uses);
  const auto has_map = [&](TextureSlot slot) { return has_texture(material, slot); };
  Rgb kd = under_map(mtl.kd, has_map(TextureSlot::base_color));
  // Where the texture isn't there, what is under it is seen.
  if (kd.is_black() && mtl.names_kd_map) kd = {0.6F, 0.6F, 0.6F};
  material.emission = under_map(mtl.ke, has_map(TextureSlot::emission));
  material.emits_both_sides = !material.emission.is_black();
  const bool has_alpha_map = has_map(TextureSlot::alpha);
  if (has_alpha_map || mtl.is_physical) material.alpha = under_map(mtl.opacity(), has_alpha_map);
  if (mtl.is_physical) {
    material.surface = to_physical(mtl, kd, has_map);
  } else {
    const Rgb ks = mtl.ks.value_or(has_map(TextureSlot::specular_color) ? Rgb{1, 1, 1} : Rgb{});
    material.surface = to_whitted(mtl, kd, ks, has_alpha_map, notes);
  }
  return material;
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") + 1 - begin);
}

MtlLibraries::MtlLibraries(const CompanionSource& companions, std::uint64_t texture_bytes, std::stop_token stop)
    : companions_(companions),
      stop_(std::move(stop)),
      search_([this](const std::string& name) { return load_file(name); }),
      textures_(companions, texture_bytes, stop_) {}

MtlLibraries::~MtlLibraries() = default;

bool MtlLibraries::load(std::string_view arguments) {
  can_read_all_ = true;
  return search_.look_for(arguments) && can_read_all_;
}

bool MtlLibraries::load_file(const std::string& name) {
  const std::optional<InputFile> file = companions_ ? companions_(name) : std::nullopt;
  if (!file) return false;
  try {
    std::string text = read_file(*file, name, kLargestFile, stop_);
    if (text.size() > bytes_left_) throw BrokenFile{{{name, "The libraries before this one are too large together"}}};
    bytes_left_ -= text.size();
    load_text(std::move(text), name);
  } catch (const BrokenFile& broken) {
    for (const FieldError& error : broken.errors) warnings.push_back({error.pointer, error.detail});
    can_read_all_ = false;
  }
  return true;
}

void MtlLibraries::load_text(std::string text, const std::string& name) {
  auto library = std::make_unique<Library>(Library{name, ImportNotes(name), {}});
  library->materials = MtlReader(std::move(text), library->name, textures_, library->notes, stop_).read();
  std::erase_if(library->materials, [&](const MtlMaterial& mtl) {
    const bool is_new = by_name_.emplace(mtl.name, static_cast<std::uint32_t>(by_name_.size())).second;
    if (!is_new) library->notes.add("A material whose name is taken was ignored", mtl.line);
    return !is_new;
  });
  libraries_.push_back(std::move(library));
}

void MtlLibraries::finish(const std::set<std::uint32_t>& used) {
  for (const auto& library : libraries_) {
    for (const MtlMaterial& mtl : library->materials) {
      std::vector<TextureUse> uses;
      if (used.contains(static_cast<std::uint32_t>(materials.size())))
        for (const MtlMap& map : mtl.maps)
          if (has_effect(map, mtl, library->notes))
            if (const auto use = textures_.use(map, library->notes)) uses.push_back(*use);
      materials.push_back(to_material(mtl, std::move(uses), library->notes));
    }
    const std::vector<SceneWarning> noted = library->notes.warnings();
    warnings.insert(warnings.end(), noted.begin(), noted.end());
  }
  textures = textures_.take();
}

std::optional<std::uint32_t> MtlLibraries::find(std::string_view name) const {
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace tessera::proto
