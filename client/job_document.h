#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace tessera::client {

/// What a user says about a job beside its scene. What isn't said is left to the document, then to the server.
struct JobOptions {
  struct Size {
    std::uint32_t width, height;
  };

  std::optional<std::string> name;  ///< Else the document's, else the file's name.
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
};

/// "640x480"; nothing when it isn't of that form.
std::optional<JobOptions::Size> parse_size(std::string_view text);

/// The job document for SCENE: a scene or job document (JSON), "-" for one on standard input, or an OBJ, PLY, STL or
/// NFF file, which is made a scene; OBJ, PLY and STL get lights, as they bring none. Which it is its content says, its
/// name only where that doesn't. The options override the document's. Throws `Failure` (local_file) when it can't be
/// read, isn't JSON, or is a file of another kind.
nlohmann::json job_document(const std::string& scene, const JobOptions& options);

/// The folder from which the paths in SCENE are taken.
std::filesystem::path folder_of(const std::string& scene);

}  // namespace tessera::client
