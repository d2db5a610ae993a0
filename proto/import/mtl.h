#pragma once

#include <cstdint>
#include <map>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/scene/material.h"
#include "proto/import/import.h"
#include "proto/wire/material_libraries.h"

namespace tessera::proto {

/// The materials of the MTL libraries that one OBJ file names (Wavefront, "Advanced Visualizer Manual", 1995, appendix
/// B), as Whitted's surfaces. What has no meaning there, or isn't written as it should be, is told in warnings.
///
/// - Colours are linear: r [g b], or xyz x [y z] (CIE 1931), where what is missing equals the first number; of a
///   spectral curve only the factor is known, as a grey.
/// - `d`, or else 1 − Tr, is opacity; of `-halo`, which makes it depend on the view, its mean over a sphere that one
/// sees.
///   What a surface doesn't stop goes through, and so does 1 − Ks in the models with refraction (6 and 7) if Tf is
///   given. Tf filters both. 6 and 7 bend it by Ni.
/// - 3 to 7 mirror with Ks, 5 and 7 by Fresnel's equations. Model 0 (constant colour) is lit as model 1; a file without
///   `illum` counts as 2.
class MtlLibraries {
 public:
  static constexpr std::uintmax_t kLargestFile = 16ULL << 20;
  /// Beyond this an OBJ file's libraries are ignored, with a warning.
  static constexpr std::uintmax_t kMostBytes = 2 * kLargestFile;

  explicit MtlLibraries(const CompanionSource& companions, std::stop_token stop = {})
      : companions_(companions),
        stop_(std::move(stop)),
        search_([this](const std::string& name) { return load_file(name); }) {}

  /// Loads the libraries of a mtllib statement. False when one isn't there or can't be read.
  bool load(std::string_view arguments);

  /// Into `materials`; nothing for a name that no library has. The first library that has a name wins.
  std::optional<std::uint32_t> find(std::string_view name) const;

  std::vector<Material> materials;
  std::vector<SceneWarning> warnings;

 private:
  bool load_file(const std::string& name);
  void load_text(std::string text, std::string_view name);

  const CompanionSource& companions_;
  const std::stop_token stop_;
  LibrarySearch search_;
  bool can_read_all_ = true;
  std::uintmax_t bytes_left_ = kMostBytes;
  std::map<std::string, std::uint32_t, std::less<>> by_name_;
};

/// Without the blanks at both ends.
std::string_view trimmed(std::string_view text);

}  // namespace tessera::proto
