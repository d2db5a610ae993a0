#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/scene/scene.h"
#include "core/scene/settings.h"
#include "proto/file_source.h"
#include "proto/wire/abandoned.h"
#include "proto/wire/priority.h"
#include "proto/wire/result.h"

namespace tessera::proto {

/// What a document may ask for at most. Beyond it is `invalid_document` with the pointer, never an allocation.
struct Limits {
  std::uint32_t max_depth = 64;                  ///< Nesting of JSON arrays and objects.
  std::uint64_t max_pixels = 1ULL << 26;         ///< width × height.
  std::uint64_t max_tiles = 1ULL << 22;          ///< Of a fixed size, in one image.
  std::uint64_t max_samples = 1ULL << 36;        ///< width × height × samples.
  std::uint64_t max_primitives = 0xFFFFFFFEULL;  ///< With instances counted.
  std::uint64_t max_scene_bytes = 4ULL << 30;    ///< core's `memory_bytes` of the scene.
  std::uint64_t max_objects = 1ULL << 26;        ///< After files and instances are expanded.
};

/// A scene that stays what it is when the files change that it was made of.
struct CapturedScene {
  std::string document;           ///< The scene's, with blobs in place of paths: it has the same hash.
  std::vector<SourceFile> files;  ///< That were named by path, or found beside one: they have to be kept as blobs.
};

struct ParsedScene {
  std::shared_ptr<const Scene> scene;
  ContentHash hash;  ///< Of what was asked for, files by their content: equal documents and files, equal hash.
  std::shared_ptr<const void> hold = nullptr;  ///< Of its stored document, which stays as long as this does.
  std::shared_ptr<const CapturedScene> captured = nullptr;  ///< Where the document names files by path.
};

/// A job as asked for, checked as far as it can be without the scene it names.
struct JobRequest {
  std::variant<ContentHash, ParsedScene> scene;
  std::optional<Camera> camera;
  Settings settings;
  bool has_image = false;             ///< Whether `settings` has the size from the job's `image`.
  bool is_one_tile = false;           ///< `settings.tile_size` is to span the image, whatever its size.
  bool has_until = false;             ///< Whether `settings.samples` has what `until` says of them.
  bool samples_to_the_limit = false;  ///< `settings.samples` is to be what `Limits` allow, whatever the size.
  std::string name;
  Priority priority = Priority::normal;
  std::string webhook = {};  ///< Where its end is told, as it was written; empty for nowhere.
};

/// Parses a whole scene document and reads the files that it names. Collects up to `kMaxFieldErrors` errors.
/// `malformed_json` when `bytes` isn't JSON or nests too deep, `invalid_document` otherwise. Never throws on bad
/// input. May take long (big files): not for an I/O thread.
///
/// Throws `Abandoned` soon after `stop` is requested (within some 10 ms), and std::system_error where `files` does.
Result<ParsedScene> parse_scene(std::string_view bytes, const FileSource& files, const Limits& limits,
                                std::stop_token stop = {});

/// The same for a job document; an inline scene's pointers start with "/scene".
Result<JobRequest> parse_job(std::string_view bytes, const FileSource& files, const Limits& limits,
                             std::stop_token stop = {});

/// What can be settled only where scene and job meet; `parse_job` has done it for an inline scene. Gives a job without
/// an `image` the size that its scene asks for, if it does. The problem, with pointers, when the job's settings go
/// beyond `limits` with it, or don't suit the scene.
std::optional<Problem> fit_to_scene(const Scene& scene, const Limits& limits, JobRequest& job);

}  // namespace tessera::proto
