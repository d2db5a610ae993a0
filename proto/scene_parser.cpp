#include "proto/scene_parser.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "proto/file_loader.h"
#include "proto/read_camera.h"
#include "proto/read_light.h"
#include "proto/read_material.h"
#include "proto/read_shape.h"
#include "proto/read_transform.h"
#include "proto/read_values.h"
#include "proto/scene_builder.h"
#include "proto/scene_hash.h"

namespace tessera::proto {
namespace {

constexpr std::size_t kNamesInMessage = 10;

const std::initializer_list<Choice<ShapeType>> kShapeTypes{
    {"mesh", ShapeType::mesh}, {"sphere", ShapeType::sphere},    {"cylinder", ShapeType::cylinder},
    {"cone", ShapeType::cone}, {"disk", ShapeType::disk},        {"quad", ShapeType::quad},
    {"file", ShapeType::file}, {"instance", ShapeType::instance}};

using Members = std::vector<std::pair<std::string_view, JsonCursor>>;

/// Sorted by key: what becomes of them may not depend on the order in which they are written.
Members sorted_members(const JsonCursor& object) {
  Members members;
  object.each_member([&](std::string_view key, JsonCursor value) { members.emplace_back(key, value); });
  std::ranges::stable_sort(members, {}, [](const auto& member) { return member.first; });
  return members;
}

template <typename T>
std::string names_in(const std::map<std::string_view, T>& table) {
  if (table.empty()) return "there are none";
  std::string names = "there are ";
  std::size_t count = 0;
  for (const auto& [name, value] : table) {
    if (count == kNamesInMessage) return names + " and " + std::to_string(table.size() - count) + " more";
    names += (count++ == 0 ? "" : ", ") + in_quotes(name);
  }
  return names;
}

/// Looks up the name that stands at `value` in the section `section` of the document.
template <typename T>
const T* find_named(const JsonCursor& value, const std::map<std::string_view, T>& table, std::string_view section) {
  if (value.kind() != JsonKind::string) {
    value.expected("the name of one of \"" + std::string(section) + "\"");
    return nullptr;
  }
  const auto found = table.find(value.string());
  if (found != table.end()) return &found->second;
  if (!value.errors().full()) {
    value.error("Nothing in \"" + std::string(section) + "\" is named " + in_quotes(value.string()) + ": " +
                names_in(table) + ".");
  }
  return nullptr;
}

/// A light of a file that stands somewhere else. Its brightness is the file's.
Light placed(Light light, const Transform& placement) {
  const auto turned = [&](UnitVec3 direction) {
    const Vec3d start = placement.point_to_world({});
    return UnitVec3::normalize(placement.point_to_world(to_double(direction)) - start).value_or(direction);
  };
  if (auto* point = std::get_if<PointLight>(&light)) {
    point->position = to_float(placement.point_to_world(to_double(point->position)));
  } else if (auto* spot = std::get_if<SpotLight>(&light)) {
    spot->position = to_float(placement.point_to_world(to_double(spot->position)));
    spot->direction = turned(spot->direction);
  } else if (auto* far = std::get_if<DirectionalLight>(&light)) {
    far->direction = turned(far->direction);
  }
  return light;
}

class SceneParser {
 public:
  SceneParser(const JsonCursor& document, const FileSource& files, const Limits& limits)
      : document_(document),
        errors_(document.errors()),
        limits_(limits),
        builder_(document, limits),
        loader_(files, builder_, errors_.steps().stop()) {}

  std::optional<ParsedScene> parse() {
    JsonFields fields(document_, "a scene");
    const auto objects = fields.required("objects");
    const auto background = fields.optional("background"), camera = fields.optional("camera"),
               ground = fields.optional("ground");
    read_schema_name(fields.optional("$schema"));
    read_materials(fields.optional("materials"));
    const auto lights = fields.optional("lights");
    read_lights(lights);
    read_geometries(fields.optional("geometries"));
    read_objects(objects);
    read_color(background, builder_.background(), kLightChannel);
    if (camera) builder_.camera() = read_camera(*camera);
    if (ground) read<bool>(ground, has_ground_, {{"shadow", true}});
    fields.refuse_unknown();
    if (builder_.lights().empty()) builder_.lights() = std::move(spare_lights_);
    if (has_ground_) builder_.add_ground();
    if (!errors_.empty()) return std::nullopt;
    warn_of_unplaced_geometries();
    warn_of_darkness(lights.value_or(document_));
    ParsedScene parsed{std::make_shared<const Scene>(std::move(builder_).finish()),
                       scene_hash(document_, loader_.identities())};
    if (auto files = loader_.assets(); !files.empty())
      parsed.captured = std::make_shared<const CapturedScene>(
          CapturedScene{document_by_content(document_, loader_.identities()), std::move(files)});
    return parsed;
  }

 private:
  struct Geometry {
    JsonCursor where;
    std::optional<std::vector<ScenePart>> parts;  // nothing when it has errors, which are said already
  };

  void read_materials(const std::optional<JsonCursor>& section) {
    if (!section) return;
    if (section->kind() != JsonKind::object) {
      section->expected("an object of names and materials");
      return;
    }
    for (const auto& [name, value] : sorted_members(*section)) {
      if (errors_.full()) return;
      materials_.emplace(name, builder_.add_material(read_material(value).value_or(Material{})));
    }
  }

  void read_lights(const std::optional<JsonCursor>& section) {
    if (!section) return;
    if (section->kind() != JsonKind::array) {
      section->expected("an array of lights");
      return;
    }
    for (const JsonCursor& value : section->elements()) {
      if (errors_.full()) return;
      const auto read = read_light(value, loader_);
      if (!read) continue;
      if (std::holds_alternative<EnvironmentLight>(read->light) && std::exchange(has_environment_, true))
        value.error("The scene has an environment already, and there is only one all around; keep one.");
      if (read->only_without_lights)
        spare_lights_.push_back(read->light);
      else
        builder_.lights().push_back(read->light);
    }
  }

  void read_geometries(const std::optional<JsonCursor>& section) {
    if (!section) return;
    if (section->kind() != JsonKind::object) {
      section->expected("an object of names and shapes");
      return;
    }
    for (const auto& [name, value] : sorted_members(*section)) {
      if (errors_.full()) return;
      geometries_.emplace(name, Geometry{value, read_geometry(value)});
    }
  }

  std::optional<std::vector<ScenePart>> read_geometry(const JsonCursor& value) {
    JsonFields fields(value, "a geometry");
    const auto type_field = fields.required("type");
    ShapeType type{};
    if (!type_field || !read(type_field, type, kShapeTypes)) return std::nullopt;
    if (type == ShapeType::instance) {
      type_field->error("A geometry can't be an instance of another; place both in \"objects\".");
      return std::nullopt;
    }
    std::optional<std::vector<ScenePart>> parts;
    if (type != ShapeType::file) {
      parts = inline_part(type, fields);
    } else if (const auto reference = loader_.find(fields)) {
      if (reference->format == FileFormat::nff) {
        fields.optional("format").value_or(value).error(
            "An NFF file brings its own lights and camera, so it can't be a geometry; place it in \"objects\".");
      } else if (const LoadedFile* file = loader_.load(*reference)) {
        parts = file->parts;
      }
    }
    fields.refuse_unknown();
    return parts;
  }

  void read_objects(const std::optional<JsonCursor>& section) {
    if (!section) return;
    if (section->kind() != JsonKind::array) {
      section->expected("an array of objects");
      return;
    }
    for (const JsonCursor& value : section->elements()) {
      if (errors_.full()) return;
      read_object(value);
    }
  }

  void read_object(const JsonCursor& value) {
    JsonFields fields(value, "an object");
    const auto type_field = fields.required("type");
    ShapeType type{};
    if (!type_field || !read(type_field, type, kShapeTypes)) return;
    const auto material_field = fields.optional("material"), transform_field = fields.optional("transform");
    const std::uint32_t* material = material_field ? find_named(*material_field, materials_, "materials") : nullptr;
    const auto placement = transform_field ? read_transform(*transform_field) : std::nullopt;

    if (type == ShapeType::instance) {
      fields.call("an instance");
      const auto of = fields.required("of");
      const Geometry* geometry = of ? find_named(*of, geometries_, "geometries") : nullptr;
      if (geometry != nullptr) placed_.insert(of->string());
      if (geometry != nullptr && geometry->parts) place(*geometry->parts, material, placement, value);
    } else if (type != ShapeType::file) {
      if (const auto parts = inline_part(type, fields)) place(*parts, material, placement, value);
    } else if (const auto reference = loader_.find(fields)) {
      const auto camera_field = fields.optional("file_camera");
      if (reference->format == FileFormat::nff) {
        read_nff(*reference, material_field, transform_field);
      } else if (const LoadedFile* file = loader_.load(*reference)) {
        place(file->parts, material, placement, value);
        take_lights(*file, placement);
        if (const NamedCamera* camera = chosen_camera(*file, camera_field)) take_camera(camera->camera, placement);
      }
    }
    fields.refuse_unknown();
  }

  void take_lights(const LoadedFile& file, const std::optional<Transform>& placement) {
    for (const Light& light : file.lights) builder_.lights().push_back(placement ? placed(light, *placement) : light);
  }

  /// The first one, unless the document says which; nothing, with an error, when there isn't that one.
  const NamedCamera* chosen_camera(const LoadedFile& file, const std::optional<JsonCursor>& field) {
    if (!field) return file.cameras.empty() ? nullptr : &file.cameras.front();
    const auto named = field->kind() == JsonKind::string
                           ? std::ranges::find(file.cameras, field->string(), &NamedCamera::name)
                           : file.cameras.end();
    if (named != file.cameras.end()) return &*named;
    std::uint64_t index = 0;
    if (field->is_number() && read(*field, index, 0, 0xFFFFFFFF) && index < file.cameras.size())
      return &file.cameras[index];
    std::string names = "The file has no such camera; it has ";
    if (file.cameras.empty()) names += "none";
    for (std::size_t i = 0; i < std::min(file.cameras.size(), kNamesInMessage); ++i)
      names += (i > 0 ? ", " : "") + std::to_string(i) + " (" + in_quotes(file.cameras[i].name) + ")";
    field->error(names + ".");
    return nullptr;
  }

  /// Of several files the first one that has a camera gives the scene its own.
  void take_camera(Camera camera, const std::optional<Transform>& placement) {
    if (builder_.camera()) return;
    if (placement) {
      View& view = std::visit([](auto& c) -> View& { return c.view; }, camera);
      const Vec3 up = view.from + view.up;
      view.from = to_float(placement->point_to_world(to_double(view.from)));
      view.at = to_float(placement->point_to_world(to_double(view.at)));
      view.up = to_float(placement->point_to_world(to_double(up))) - view.from;
    }
    builder_.camera() = camera;
  }

  /// A whole scene in a file: also its lights, and its camera and background where the document has none.
  void read_nff(const FileReference& reference, const std::optional<JsonCursor>& material,
                const std::optional<JsonCursor>& transform) {
    constexpr std::string_view kWhy = "An NFF file is a scene of its own, with lights, camera and materials; ";
    if (material) material->error(std::string(kWhy) + "leave \"material\" out.");
    if (transform) transform->error(std::string(kWhy) + "leave \"transform\" out.");
    if (has_nff_) reference.where.error(std::string(kWhy) + "a scene takes only one.");
    if (material || transform || has_nff_) return;
    has_nff_ = true;
    const LoadedFile* file = loader_.load(reference);
    if (file == nullptr) return;
    place(file->parts, nullptr, std::nullopt, reference.where);
    auto& lights = builder_.lights();
    lights.insert(lights.end(), file->lights.begin(), file->lights.end());
    // The document's own come later and override these.
    builder_.background() = file->background.value_or(Rgb{});
    if (!file->cameras.empty()) builder_.camera() = file->cameras.front().camera;
    take_image(*file, reference);
  }

  void take_image(const LoadedFile& file, const FileReference& reference) {
    if (!file.image) return;
    const std::uint64_t pixels = std::uint64_t{file.image->width} * file.image->height;
    if (pixels <= limits_.max_pixels) {
      builder_.image() = file.image;
    } else {
      builder_.warn(reference.where, "The file's resolution has " + std::to_string(pixels) + " pixels; at most " +
                                         std::to_string(limits_.max_pixels) +
                                         " are allowed, so it doesn't size the image.");
    }
  }

  std::optional<std::vector<ScenePart>> inline_part(ShapeType type, JsonFields& fields) {
    auto read = read_inline_shape(type, fields);
    if (!read) return std::nullopt;
    if (read->dropped.total() > 0) {
      builder_.warn(fields.value(), "Dropped triangles: " + std::to_string(read->dropped.not_finite) +
                                        " with coordinates beyond 1e18, " + std::to_string(read->dropped.degenerate) +
                                        " with two corners at one place.");
    }
    const auto shape = builder_.add_shape(std::move(read->shape), fields.value());
    if (!shape) return std::nullopt;
    return std::vector{ScenePart{*shape, std::nullopt}};
  }

  /// Where a part stands, its file being placed; nothing, with an error, where that can't be.
  static std::optional<std::optional<Transform>> placement_of(const ScenePart& part,
                                                              const std::optional<Transform>& placement,
                                                              const JsonCursor& where) {
    if (!part.placement || !placement) return part.placement ? part.placement : placement;
    const auto both = composed(*placement, *part.placement);
    if (!both) where.error("The transform makes placements within the file too extreme for single precision.");
    return both ? std::optional(both) : std::nullopt;
  }

  /// `material` overrides those of the parts.
  void place(const std::vector<ScenePart>& parts, const std::uint32_t* material,
             const std::optional<Transform>& placement, const JsonCursor& where) {
    for (const ScenePart& part : parts) {
      errors_.steps().take();
      std::uint32_t shown = 0;
      if (material != nullptr) {
        shown = *material;
      } else {
        shown = part.material ? *part.material : builder_.default_material();
      }
      const auto whole = placement_of(part, placement, where);
      if (!whole || !builder_.add_object({part.shape, shown, *whole}, where)) return;
      if (builder_.emits(shown) && !builder_.has_area(part.shape))
        builder_.warn(where, "The material emits, and the mesh has no area to send light from.");
    }
  }

  void warn_of_unplaced_geometries() {
    for (const auto& [name, geometry] : geometries_) {
      if (!placed_.contains(name)) builder_.warn(geometry.where, "No object places this geometry.");
    }
  }

  void warn_of_darkness(const JsonCursor& where) {
    if (builder_.is_dark()) builder_.warn(where, "The scene has no light that isn't black, so its surfaces are black.");
  }

  JsonCursor document_;
  FieldErrors& errors_;
  const Limits& limits_;
  SceneBuilder builder_;
  FileLoader loader_;
  std::map<std::string_view, std::uint32_t> materials_;
  std::map<std::string_view, Geometry> geometries_;
  std::set<std::string_view> placed_;  // geometries
  std::vector<Light> spare_lights_;    // where there are no others
  bool has_nff_ = false, has_environment_ = false, has_ground_ = false;
};

}  // namespace

std::optional<ParsedScene> read_scene(const JsonCursor& document, const FileSource& files, const Limits& limits) {
  return SceneParser(document, files, limits).parse();
}

}  // namespace tessera::proto
