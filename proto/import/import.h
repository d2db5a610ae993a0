#pragma once

#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/scene.h"
#include "proto/import/input_file.h"
#include "proto/wire/abandoned.h"
#include "proto/wire/choice.h"
#include "proto/wire/result.h"

namespace tessera::proto {

enum class FileFormat { obj, ply, nff, gltf, stl };
std::span<const Choice<FileFormat>> file_format_names();

/// A shape from a file, with the material that the file gives it (into `Imported::materials`), if it does.
struct ImportedPart {
  Shape shape;
  std::optional<std::uint32_t> material;
};

/// A part of `Imported`, somewhere: with the material of the part, unless it has its own.
struct ImportedPlacement {
  std::uint32_t part = 0;
  std::optional<Transform> placement;
  std::optional<std::uint32_t> material;
};

struct NamedCamera {
  std::string name;  ///< May be empty.
  Camera camera;
};

/// A file's content in core's terms. Background and image size come from NFF alone.
struct Imported {
  std::vector<ImportedPart> parts;
  std::vector<ImportedPlacement> placements;  ///< Where there are none, each part stands once, as it is.
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<Light> lights;
  std::optional<Rgb> background;
  std::vector<NamedCamera> cameras;
  std::optional<ImageSize> image;
  std::vector<SceneWarning> warnings;  ///< Dropped triangles, ignored statements, missing MTL files, counted.
};

/// What a document may say of a file.
struct ImportOptions {
  std::optional<float> smooth = {};  ///< Meshes without normals get some; edges that bend by more degrees stay sharp.
  std::optional<std::string> variant = {};  ///< Of glTF's materials, by name.
  std::optional<std::uint32_t> scene = {};  ///< Of a glTF file with several.
  bool operator==(const ImportOptions&) const = default;
};

/// Finds a file that the imported file refers to by name (an MTL library, an image); nothing when there is none.
using CompanionSource = std::function<std::optional<InputFile>(std::string_view name)>;

/// Reads a file. A broken file is `invalid_document` whose errors point at "<display_name>:<line>" where lines
/// exist, and at "<display_name>/a/json/pointer" in glTF; at "variant" and "scene" where that option names nothing.
/// Never allocates more than a small multiple of the file's size. Textures take at most `texture_bytes` each. A missing
/// library is an `internal_error`. Throws `Abandoned`, and nothing else, soon after `stop` is requested.
Result<Imported> import_file(const InputFile& file, FileFormat format, std::string_view display_name,
                             const CompanionSource& companions, std::stop_token stop = {},
                             const ImportOptions& options = {}, std::uint64_t texture_bytes = 1ULL << 30);

/// By the ending of a name, in any case (.glb is glTF, too); nothing when it is none of ours.
std::optional<FileFormat> format_of(std::string_view file_name);

}  // namespace tessera::proto
