#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/wire/material_libraries.h"

namespace tessera::proto {

/// The keywords of an MTL library's statements that name textures which are read, in lower case.
inline constexpr std::string_view kTextureKeywords[] = {"map_kd",   "map_ks", "map_ke", "map_d",  "norm",   "bump",
                                                        "map_bump", "map_pr", "map_pm", "map_ps", "map_pc", "map_pcr"};

/// What follows such a keyword: options, and the name of an image, which may hold blanks and stand before them.
struct TextureStatement {
  struct Option {
    std::string_view name;  ///< With its dash.
    std::vector<std::string_view> values;
  };
  std::vector<Option> options;
  std::string_view file;  ///< As it is written; empty where there is none.
};

/// Takes the statement apart. Of options that aren't known everything belongs to the name.
TextureStatement split_texture_statement(std::string_view arguments);

/// The image that a line of a PLY header names, as MeshLab writes it: "comment TextureFile name". Empty for other
/// lines.
std::string_view ply_texture_file(std::string_view line);

/// Looks for the images that MTL libraries and PLY files name. Who looks into the same files finds the same ones.
class TextureSearch {
 public:
  /// Beyond so many names nothing is looked for.
  static constexpr std::size_t kMostNames = 1 << 14;

  /// `take` is asked for names as `LibrarySearch`'s is.
  explicit TextureSearch(AskedNames::Take take) : names_(std::move(take), kMostNames) {}

  /// The name by which an image was taken that `library`, a name that was taken itself (empty for the file), writes as
  /// `file`: from the
  /// library's folder, then from the OBJ file's, then without its folders in the library's; as it is written, then up
  /// to a comment.
  std::optional<std::string> look_for(std::string_view library, std::string_view file);

 private:
  AskedNames names_;
};

}  // namespace tessera::proto
