#include "proto/read_accel.h"

#include <algorithm>

#include "core/accel/accel_table.h"
#include "core/bounds/slab_presets.h"
#include "proto/read_values.h"

namespace tessera::proto {
namespace {

using std::string_view;

std::string in_words(std::span<const string_view> names) {
  std::string text;
  for (const string_view name : names) text += (text.empty() ? "" : ", ") + std::string(name);
  return text;
}

/// Nothing, with an error where it stands, for a name that no structure has.
std::optional<AccelKind> read_kind(std::optional<JsonCursor> value) {
  if (!value) return std::nullopt;
  std::vector<AccelKind> kinds{AccelKind::automatic};
  for (const AccelEntry& row : accel_table()) kinds.push_back(row.kind);
  std::vector<string_view> names;
  for (const AccelKind kind : kinds) names.push_back(accel_name(kind));
  const std::size_t chosen = read_choice(*value, names);
  if (chosen == names.size()) return std::nullopt;
  return kinds[chosen];
}

/// The names of the options that a kind reads; none for `automatic`.
std::span<const string_view> options_of(AccelKind kind) {
  const AccelEntry* row = accel_entry(kind);
  return row ? row->options : std::span<const string_view>();
}

bool uses(AccelKind kind, string_view option) {
  return std::ranges::find(options_of(kind), option) != options_of(kind).end();
}

std::string unused(AccelKind kind, string_view option) {
  std::vector<string_view> users;
  for (const AccelEntry& row : accel_table())
    if (uses(row.kind, option)) users.push_back(row.name);
  const auto taken = options_of(kind);
  return "The kind " + in_quotes(accel_name(kind)) + " doesn't use " + in_quotes(option) + "; " + in_words(users) +
         (users.size() == 1 ? " does. It takes " : " do. It takes ") +
         (taken.empty() ? "no options" : in_words(taken)) + ".";
}

/// The value at `value`, of an enumeration whose names stand in its order.
template <typename Enum>
bool read_named(JsonCursor value, Enum& out, std::span<const string_view> names) {
  const std::size_t chosen = read_choice(value, {names.begin(), names.end()});
  if (chosen == names.size()) return false;
  out = static_cast<Enum>(chosen);
  return true;
}

bool read_normal(JsonCursor value, Vec3& out) {
  if (!read(value, out, kAnyNumber)) return false;
  if (out == Vec3{}) return value.error("A normal can't be [0, 0, 0]; give it any length but zero.");
  return true;
}

bool read_normals(JsonCursor value, std::vector<Vec3>& out) {
  if (value.is_number()) {
    for (const int preset : kSlabPresets)
      if (value.number() == preset) {
        out = slab_preset(preset);
        return true;
      }
  } else if (value.kind() == JsonKind::array && value.size() >= 1 && value.size() <= kMostNormals) {
    out.assign(value.size(), {});
    auto normal = out.begin();
    bool good = true;
    for (const JsonCursor& element : value.elements()) good &= read_normal(element, *normal++);
    return good;
  }
  std::string presets;
  for (const int preset : kSlabPresets) presets += std::to_string(preset) + ", ";
  return value.expected("a preset (" + presets.substr(0, presets.size() - 2) + "), or an array of 1 to " +
                        std::to_string(kMostNormals) + " normals, each an array of 3 numbers");
}

bool read_option(const AccelOptionEntry& option, JsonCursor value, AccelOptions& accel) {
  switch (option.type) {
    case AccelOptionType::number:
      return read(value, accel.*option.number, option.least, option.most);
    case AccelOptionType::bound:
      return read_named(value, accel.bound, bound_names());
    case AccelOptionType::space:
      return read_named(value, accel.space, space_names());
    case AccelOptionType::normals:
      return read_normals(value, accel.normals);
  }
  return false;
}

}  // namespace

void read_accel(JsonCursor value, AccelOptions& accel) {
  JsonFields fields(value, "an accel");
  const std::optional<AccelKind> kind = read_kind(fields.required("kind"));
  if (kind) accel.kind = *kind;
  bool bound_is_known = true;
  for (const AccelOptionEntry& option : accel_option_table()) {  // "bound" comes before what depends on it
    const auto given = fields.optional(option.name);
    if (!given) continue;
    if (kind && !uses(*kind, option.name)) {
      given->error(unused(*kind, option.name));
    } else if (bound_is_known && option.only_with && *option.only_with != accel.bound) {
      const auto name = [](BoundKind bound) { return in_quotes(bound_names()[static_cast<std::size_t>(bound)]); };
      given->error(in_quotes(option.name) + " goes with the bound " + name(*option.only_with) + "; here it is " +
                   name(accel.bound) + ".");
    } else if (!read_option(option, *given, accel)) {
      bound_is_known &= option.type != AccelOptionType::bound;
    }
  }
  fields.refuse_unknown();
}

}  // namespace tessera::proto
