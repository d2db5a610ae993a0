#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "proto/json_cursor.h"
#include "proto/parse.h"

namespace tessera::proto {

/// A shape of the scene, with the material that its file gave it, where the file has it.
struct ScenePart {
  std::uint32_t shape = 0;
  std::optional<std::uint32_t> material;
  std::optional<Transform> placement = std::nullopt;
};

/// Puts a scene together within the limits. Each step that would go beyond one says so at the place that asked for
/// it and does nothing.
class SceneBuilder {
 public:
  /// `scene` is the scene document; pointers of warnings start there.
  SceneBuilder(JsonCursor scene, const Limits& limits) : document_(scene), limits_(limits) {}

  std::uint32_t add_material(const Material& material);

  /// Adds textures that materials to come will name, the first of them by the number that is told; nothing where their
  /// images take more than a scene may.
  std::optional<std::uint32_t> add_textures(const std::vector<Texture>& textures, const JsonCursor& where);

  /// The grey of objects that name no material.
  std::uint32_t default_material();

  bool emits(std::uint32_t material) const { return !scene_.materials[material].emission.is_black(); }

  std::optional<std::uint32_t> add_shape(Shape shape, const JsonCursor& where);
  bool add_object(const Object& object, const JsonCursor& where);

  /// Warnings beyond the first `kMaxWarnings` are only counted.
  void warn(const JsonCursor& where, std::string detail);
  void warn(SceneWarning warning);

  /// Bytes that shapes and objects may still take.
  std::uint64_t bytes_left() const { return limits_.max_scene_bytes - bytes_; }

  /// Counts what else the scene takes of them.
  bool take(std::uint64_t bytes, const JsonCursor& where);

  /// The parts of the scene that no limit holds.
  std::vector<Light>& lights() { return scene_.lights; }
  Rgb& background() { return scene_.background; }
  std::optional<Camera>& camera() { return scene_.camera; }
  std::optional<ImageSize>& image() { return scene_.image; }

  /// Whether anything of a shape can be seen, or send light: not of a mesh without triangles, or whose triangles are
  /// lines.
  bool has_area(std::uint32_t shape) const;

  /// Whether there are objects, but no light and no background that isn't black.
  bool is_dark() const;

  /// A ground that all objects stand on; none where there are none.
  void add_ground();

  /// Everything added, without the shapes that no object shows.
  Scene finish() &&;

  static constexpr std::size_t kMaxWarnings = 100;

 private:
  bool stays_within_coordinates(const Object& object) const;

  JsonCursor document_;
  const Limits& limits_;
  Scene scene_;
  std::vector<bool> shape_has_area_;
  std::optional<std::uint32_t> default_material_;
  std::uint64_t bytes_ = 0, primitives_ = 0, warnings_left_out_ = 0;
};

}  // namespace tessera::proto
