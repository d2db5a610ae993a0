#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/scene/material.h"
#include "proto/import/import.h"
#include "proto/import/import_notes.h"
#include "proto/import/mtl_textures.h"
#include "proto/wire/material_libraries.h"

namespace tessera::proto {

struct MtlMaterial;

/// The materials of the MTL libraries that one OBJ file names (Wavefront, "Advanced Visualizer Manual", 1995, appendix
/// B; its physically based extension, Boubekeur & Harris 2016), as Whitted's surfaces, or as `MetallicRoughness` and
/// `Layered` where a statement of the extension says something of them. What has no meaning there, or isn't written as
/// it should be, is told in warnings.
///
/// - Colours are linear: r [g b], or xyz x [y z] (CIE 1931), where what is missing equals the first number; of a
///   spectral curve only the factor is known, as a grey.
/// - `d`, or else 1 − Tr, is opacity; of `-halo`, which makes it depend on the view, its mean over a sphere that one
/// sees.
///   What a surface doesn't stop goes through, and so does 1 − Ks in the models with refraction (6 and 7) if Tf is
///   given. Tf filters both. 6 and 7 bend it by Ni.
/// - 3 to 7 mirror with Ks, 5 and 7 by Fresnel's equations. Model 0 (constant colour) is lit as model 1; a file without
///   `illum` counts as 2.
/// - Ke is the radiance that both sides send out.
/// - Textures multiply the number or colour of their name, which counts as 1 where it is missing or, but for map_Ks, 0,
///   as many programs write it. map_Kd, map_Ks and map_Ke are sRGB unless they are floats. map_d is the image's alpha
///   where it has some. A bump map whose name says that it holds normals is read as such. `-imfchan`, `-bm`, `-s`,
///   `-o`, `-clamp` and `-colorspace` are known.
class MtlLibraries {
 public:
  static constexpr std::uintmax_t kLargestFile = 16ULL << 20;
  /// Beyond this an OBJ file's libraries are ignored, with a warning.
  static constexpr std::uintmax_t kMostBytes = 2 * kLargestFile;

  /// A texture may take `texture_bytes`.
  MtlLibraries(const CompanionSource& companions, std::uint64_t texture_bytes, std::stop_token stop);
  ~MtlLibraries();

  /// Loads the libraries of a mtllib statement. False when one isn't there or can't be read.
  bool load(std::string_view arguments);

  /// The material of that name, by its number; nothing where no library has one. The first library that has it wins.
  std::optional<std::uint32_t> find(std::string_view name) const;

  /// Makes `materials` and `textures`, with those textures alone that the materials of `used` have. Once, in the end.
  void finish(const std::set<std::uint32_t>& used);

  std::vector<Material> materials;  ///< By their numbers.
  std::vector<Texture> textures;
  std::vector<SceneWarning> warnings;

 private:
  struct Library {
    std::string name;
    ImportNotes notes;
    std::vector<MtlMaterial> materials;
  };
  bool load_file(const std::string& name);
  void load_text(std::string text, const std::string& name);

  const CompanionSource& companions_;
  const std::stop_token stop_;
  LibrarySearch search_;
  MtlTextures textures_;
  bool can_read_all_ = true;
  std::uintmax_t bytes_left_ = kMostBytes;
  std::vector<std::unique_ptr<Library>> libraries_;
  std::map<std::string, std::uint32_t, std::less<>> by_name_;
};

/// Without the blanks at both ends.
std::string_view trimmed(std::string_view text);

}  // namespace tessera::proto
