#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "proto/wire/model_picture.h"

namespace tessera::client {

/// What a user says about a job beside its scene. What isn't said is left to the document, then to the server.
struct JobOptions {
  struct Size {
    std::uint32_t width, height;
  };

  std::optional<std::string> name;  ///< Else the document's, else the file's name.
  std::optional<std::string> priority;
  std::optional<std::string> webhook;  ///< The URL that the server tells the job's end to.
  std::optional<Size> size;
  std::optional<std::uint64_t> samples, max_depth, seed;
  std::optional<std::string> integrator, sampler;
  std::optional<double> error, seconds;  ///< Until which the image is refined; `samples` are the most then.
  bool transparent = false;              ///< False leaves it to the document.
  std::optional<std::string> accel;      ///< As `parse_accel` takes it.
  std::optional<std::string> screen_bounds;
  std::optional<std::string> tile_size;  ///< auto, whole, or a number of pixels.
  std::vector<std::string> aovs;
  bool count_tests = false;  ///< False leaves it to the document.

  // Of a model's file that is given by itself; documents say it themselves.
  std::optional<std::string> camera;  ///< One of the file's, by name or index.
  proto::ViewAngles angles;
  std::optional<std::string> environment;  ///< An image's file, or as `environment_light` takes it.
  std::optional<std::string> variant;
  std::optional<double> smooth;
  bool has_z_up = false;
  bool has_no_ground = false;
  bool shows_environment = false;  ///< Behind it all.

  /// The names of those that are given, as the command line has them.
  std::vector<std::string> of_models() const;
};

/// "640x480"; nothing when it isn't of that form.
std::optional<JobOptions::Size> parse_size(std::string_view text);

/// "gltf", "obj", "ply", "stl" or "nff" where SCENE is the file of a model, which is for its content to say, and for
/// its name only where that doesn't; else empty. Throws `Failure` (local_file) when it can't be read.
std::string model_format(const std::string& scene);

/// The job document for SCENE: a scene or job document (JSON), "-" for one on standard input, or a model's file, which
/// becomes the picture that the server's POST /v1/render makes of it. The options override the document's. Throws
/// `Failure`: local_file when it can't be read, isn't JSON, or is a file of another kind; usage for options of models
/// that a document has no place for.
nlohmann::json job_document(const std::string& scene, const JobOptions& options);

/// The folder from which the paths in SCENE are taken.
std::filesystem::path folder_of(const std::string& scene);

/// The files that the user names, SCENE among them.
std::vector<std::filesystem::path> named_files(const std::string& scene, const JobOptions& options);

}  // namespace tessera::client
