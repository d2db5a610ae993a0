#include "proto/import/mtl_textures.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <iterator>
#include <utility>

#include "proto/import/numbers.h"
#include "proto/import/obj_text.h"

namespace tessera::proto {
namespace {

constexpr std::array<std::pair<std::string_view, TextureSlot>, std::size(kTextureKeywords)> kSlots{{
    {"map_kd", TextureSlot::base_color},
    {"map_ks", TextureSlot::specular_color},
    {"map_ke", TextureSlot::emission},
    {"map_d", TextureSlot::alpha},
    {"norm", TextureSlot::normal},
    {"bump", TextureSlot::bump},
    {"map_bump", TextureSlot::bump},
    {"map_pr", TextureSlot::roughness},
    {"map_pm", TextureSlot::metallic},
    {"map_ps", TextureSlot::sheen_color},
    {"map_pc", TextureSlot::clearcoat},
    {"map_pcr", TextureSlot::clearcoat_roughness},
}};

float number(std::string_view word, ImportNotes& notes, std::size_t line) {
  const auto value = parse_float(word);
  if (value && std::abs(*value) <= 1e6F) return *value;
  notes.add("A number of a texture that isn't one, or is beyond a million, counts as 0", line);
  return 0;
}

/// Whether an option that isn't read asks for what is done anyway.
bool is_usual(std::string_view name, const std::vector<std::string_view>& values) {
  const auto is = [&](std::initializer_list<std::string_view> usual) {
    return std::ranges::equal(values, usual, [](auto a, auto b) { return lower_case(a) == b; });
  };
  if (name == "-blendu" || name == "-blendv") return is({"on"});
  if (name == "-cc") return is({"off"});
  if (name == "-mm") return values.size() == 2 && parse_float(values[0]) == 0.0F && parse_float(values[1]) == 1.0F;
  if (name == "-t") return std::ranges::all_of(values, [](auto v) { return parse_float(v) == 0.0F; });
  return name == "-texres";
}

void read_option(const TextureStatement::Option& option, MtlMap& map, ImportNotes& notes) {
  const auto& [name, values] = option;
  if (values.empty()) return notes.add("An option of a texture without its value was ignored", map.line);
  const std::string first = lower_case(values[0]);
  if (name == "-s" || name == "-o") {
    auto& numbers = name == "-s" ? map.scale : map.offset;
    for (std::size_t i = 0; i < std::min(values.size(), numbers.size()); ++i)
      numbers[i] = number(values[i], notes, map.line);
  } else if (name == "-bm") {
    map.height = number(first, notes, map.line);
  } else if (name == "-clamp") {
    map.is_clamped = first == "on";
  } else if (name == "-colorspace" && (first == "srgb" || first == "linear")) {
    map.is_srgb = first == "srgb";
  } else if (name == "-imfchan" && first.size() == 1 && std::string_view("rgbmlz").find(first) != std::string::npos) {
    constexpr std::array<std::uint8_t, 6> kChannels{0, 1, 2, 3, 0, 0};  // luminance and depth are those of greys
    map.channel = kChannels[std::string_view("rgbmlz").find(first)];
  } else if (!is_usual(name, values)) {
    notes.add("An option of a texture other than -s, -o, -bm, -clamp, -imfchan and -colorspace was ignored", map.line);
  }
}

/// Many programs export maps of normals as what MTL has for heights.
bool tells_of_normals(std::string_view name) {
  const std::string file = lower_case(name.substr(name.rfind('/') + 1));
  return std::ranges::any_of(std::array{"normal", "nrm", "_nor.", "_nor_", "_ddn."},
                             [&](std::string_view part) { return file.find(part) != file.npos; });
}

bool is_color(TextureSlot slot) {
  return slot == TextureSlot::base_color || slot == TextureSlot::specular_color || slot == TextureSlot::emission;
}

/// Of textures that aren't there.
constexpr std::size_t kMostNamed = 20;

/// Names are cut where a message gets too long.
std::string in_quotes(std::string_view name) { return '"' + std::string(name.substr(0, 80)) + '"'; }

}  // namespace

MtlTextures::MtlTextures(const CompanionSource& companions, std::uint64_t most_bytes, std::stop_token stop)
    : search_([this, &companions](const std::string& name) {
        const auto file = companions ? companions(name) : std::nullopt;
        if (file) found_.emplace(name, *file);
        return file.has_value();
      }),
      files_(most_bytes, std::move(stop)) {}

std::optional<MtlMap> MtlTextures::read(std::string_view library, std::string_view keyword, std::string_view arguments,
                                        ImportNotes& notes, std::size_t line) {
  const TextureStatement statement = split_texture_statement(arguments);
  const auto name = search_.look_for(library, statement.file);
  if (!name) {
    const bool is_named = missing_.size() < kMostNamed && missing_.emplace(statement.file).second;
    const bool is_known = is_named || missing_.contains(std::string(statement.file));
    notes.add(is_known ? "The texture " + in_quotes(statement.file) + " isn't there" : "Another texture isn't there",
              line);
    return std::nullopt;
  }
  MtlMap map;
  map.slot = std::ranges::find(kSlots, keyword, &std::pair<std::string_view, TextureSlot>::first)->second;
  map.name = *name;
  map.file = found_.at(*name);
  map.line = line;
  for (const auto& option : statement.options) read_option(option, map, notes);
  if (map.slot == TextureSlot::bump && tells_of_normals(map.name)) {
    notes.add("A bump map whose name says that it holds normals is read as such", line);
    map.slot = TextureSlot::normal;
  }
  return map;
}

std::optional<TextureUse> MtlTextures::use(const MtlMap& map, ImportNotes& notes) {
  const TextureFiles::Opened& file = files_.open(map.file, map.name);
  if (!file.image) {
    notes.add("The texture " + in_quotes(map.name) + " can't be used: " + file.problem, map.line);
    return std::nullopt;
  }
  Texture texture;
  texture.image = file.image;
  texture.wrap_u = texture.wrap_v = map.is_clamped ? Wrap::clamp : Wrap::repeat;
  texture.is_srgb = map.is_srgb.value_or(is_color(map.slot) && !file.is_linear);
  // MTL's v grows upwards, that of textures downwards: (1 - v) is scaled and moved.
  const auto [su, sv] = map.scale;
  const auto [ou, ov] = map.offset;
  texture.transform = {su, 0, ou, 0, sv, 1 - sv - ov};

  const Key key{texture.image.get(), map.is_clamped, texture.is_srgb, texture.transform};
  const auto [known, is_new] = known_.try_emplace(key, static_cast<std::uint32_t>(textures_.size()));
  if (is_new) textures_.push_back(std::move(texture));
  const bool is_in_alpha = map.slot == TextureSlot::alpha && file.has_alpha;
  const std::uint8_t channel = map.channel.value_or(is_in_alpha ? 3 : 0);
  return TextureUse{map.slot, known->second, channel, map.height};
}

}  // namespace tessera::proto
