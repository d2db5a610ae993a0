#include "proto/import/ply.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include "core/math/srgb.h"
#include "proto/import/broken_file.h"
#include "proto/import/import_notes.h"
#include "proto/import/mesh_repair.h"
#include "proto/import/ply_body.h"
#include "proto/import/ply_header.h"
#include "proto/import/polygon.h"
#include "proto/import/texture_files.h"
#include "proto/wire/material_textures.h"

namespace tessera::proto {
namespace {

bool is_index_list(const PlyProperty& p) { return p.name == "vertex_indices" || p.name == "vertex_index"; }

/// What a vertex property holds: numbers of these, one after the other.
enum Column : std::size_t { kPosition = 0, kNormal = 3, kTexcoord = 6, kColor = 8, kAlpha = 11, kNoColumn = 12 };

std::size_t column_of(const PlyProperty& p) {
  constexpr std::array<std::array<std::string_view, 3>, kNoColumn> kNames{{{"x"},
                                                                           {"y"},
                                                                           {"z"},
                                                                           {"nx"},
                                                                           {"ny"},
                                                                           {"nz"},
                                                                           {"s", "u", "texture_u"},
                                                                           {"t", "v", "texture_v"},
                                                                           {"red", "diffuse_red", "r"},
                                                                           {"green", "diffuse_green", "g"},
                                                                           {"blue", "diffuse_blue", "b"},
                                                                           {"alpha", "diffuse_alpha", "a"}}};
  if (p.count_type) return kNoColumn;
  return static_cast<std::size_t>(
      std::ranges::find_if(kNames, [&](const auto& names) { return std::ranges::find(names, p.name) != names.end(); }) -
      kNames.begin());
}

/// Texture coordinates of a face's corners, u v after u v, as MeshLab writes them.
bool is_texcoord_list(const PlyProperty& p) {
  return p.name == "texcoord" && p.count_type && p.type >= PlyScalar::float32;
}

/// What counts as 1 of a colour's number; of floats it shows once all are known.
float brightest_of(PlyScalar type) { return type == PlyScalar::uint16 ? 65535 : 255; }

template <typename Body>
class PlyReader {
 public:
  PlyReader(const PlyHeader& header, Body body, std::string_view file_name, TextureFiles::Opened texture,
            ImportNotes notes, std::stop_token stop)
      : steps_(std::move(stop)),
        header_(header),
        body_(body),
        file_name_(file_name),
        texture_(std::move(texture)),
        notes_(std::move(notes)) {}

  Imported read() {
    check_header();
    read_elements();

    Imported result;
    finish_attributes();
    repair_mesh(mesh_, notes_);
    if (mesh_.triangles.empty()) {
      notes_.add("The file has no triangles");
      if (has_faces_) refuse();
    } else {
      if (is_textured() || has_colors_)
        mesh_.attributes = std::make_shared<const MeshAttributes>(std::move(attributes_));
      result.parts.push_back({std::move(mesh_), std::nullopt});
      if (is_textured() || has_colors_) add_material(result);
    }
    result.warnings = notes_.warnings();
    return result;
  }

 private:
  [[noreturn]] void fail(std::size_t line, std::string detail) const {
    throw BrokenFile{{{file_place(file_name_, line), std::move(detail)}}};
  }

  /// Nothing is left of the file's faces.
  [[noreturn]] void refuse() {
    if (errors_.empty()) {
      for (const SceneWarning& warning : notes_.warnings()) errors_.push_back({warning.pointer, warning.detail});
    }
    throw BrokenFile{std::move(errors_)};
  }

  static bool holds_faces(const PlyElement& e) { return e.name == "face" || e.name == "tristrips"; }

  void check_header() {
    find_texcoords();
    bool has_vertices = false;
    for (const PlyElement& element : header_.elements) {
      if (element.name == "vertex") {
        has_vertices = true;
        check_vertex(element);
      } else if (holds_faces(element)) {
        check_faces(element);
      } else {
        notes_.add("The element \"" + element.name.substr(0, 40) + "\" is ignored", element.line);
      }
    }
    if (!has_vertices) fail(0, "The file has no element \"vertex\"");
  }

  /// Those of vertices, or else of faces' corners, where there is a texture.
  void find_texcoords() {
    if (!texture_.image) return;
    bool has_u = false, has_v = false, has_lists = false;
    for (const PlyElement& element : header_.elements) {
      for (const PlyProperty& property : element.properties) {
        has_u |= element.name == "vertex" && column_of(property) == kTexcoord;
        has_v |= element.name == "vertex" && column_of(property) == kTexcoord + 1;
        has_lists |= element.name == "face" && is_texcoord_list(property);
      }
    }
    has_texcoords_ = has_u && has_v;
    has_corner_texcoords_ = !has_texcoords_ && has_lists;
    if (!is_textured()) notes_.add("The file names a texture, but has no texture coordinates");
  }

  bool is_textured() const { return has_texcoords_ || has_corner_texcoords_; }

  void check_vertex(const PlyElement& vertex) {
    std::array<bool, kNoColumn + 1> has{};
    for (const PlyProperty& property : vertex.properties) {
      const std::size_t column = column_of(property);
      columns_.push_back(std::exchange(has[column], true) ? std::size_t{kNoColumn} : column);
    }
    const auto has_all = [&](Column first, std::size_t count) {
      return std::all_of(has.begin() + first, has.begin() + first + static_cast<std::ptrdiff_t>(count),
                         std::identity());
    };
    if (!has_all(kPosition, 3)) fail(vertex.line, "The element \"vertex\" needs properties x, y and z");
    has_normals_ = has_all(kNormal, 3);
    has_colors_ = !is_textured() && has_all(kColor, 3);
    has_alpha_ = has_colors_ && has[kAlpha];
    std::string unused;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (is_wanted(columns_[i])) continue;
      columns_[i] = kNoColumn;
      unused += ' ' + vertex.properties[i].name;
    }
    note_unused(vertex, unused);
  }

  bool is_wanted(std::size_t column) const {
    if (column < kNormal) return true;
    if (column < kTexcoord) return has_normals_;
    if (column < kColor) return has_texcoords_;
    if (column < kAlpha) return has_colors_;
    return column == kAlpha && has_alpha_;
  }

  void check_faces(const PlyElement& faces) {
    std::size_t lists = 0;
    std::string unused;
    for (const PlyProperty& property : faces.properties) {
      if (!is_index_list(property)) {
        const bool is_read = has_corner_texcoords_ && faces.name == "face" && is_texcoord_list(property);
        if (!is_read) unused += ' ' + property.name;
        continue;
      }
      ++lists;
      if (!property.count_type || property.type >= PlyScalar::float32) {
        fail(faces.line, "The property " + property.name + " must be a list of an integer type");
      }
    }
    if (lists != 1) {
      fail(faces.line, "The element \"" + faces.name + "\" needs one list vertex_indices or vertex_index");
    }
    note_unused(faces, unused);
  }

  void note_unused(const PlyElement& element, const std::string& names) {
    if (!names.empty())
      notes_.add("Of the element \"" + element.name.substr(0, 40) + "\" is ignored:" + names.substr(0, 200),
                 element.line);
  }

  static std::uint64_t least_size(const PlyElement& element) {
    std::uint64_t size = 0;
    for (const PlyProperty& p : element.properties) size += Body::least_size(p.count_type.value_or(p.type));
    return size;
  }

  /// Refuses counts that the file's size can't hold, before anything is allocated for them.
  void check_size() const {
    std::uint64_t least = 0;
    for (const PlyElement& element : header_.elements) {
      const std::uint64_t size = least_size(element);
      if (size != 0 && element.count > (std::numeric_limits<std::uint64_t>::max() - least) / size) {
        fail(element.line, "The count of \"" + element.name.substr(0, 40) + "\" is beyond any file");
      }
      least += element.count * size;
    }
    if (least > body_.bytes_left()) fail_short(file_name_, least - body_.bytes_left());
  }

  /// Faces are cut as they are read, so those that stand before the vertices are left for later.
  void read_elements() {
    check_size();
    std::uint64_t following = 0;
    for (const PlyElement& element : header_.elements) following += element.count * least_size(element);
    bool has_vertices = false;
    std::vector<std::pair<const PlyElement*, Body>> later;
    for (const PlyElement& element : header_.elements) {
      following -= element.count * least_size(element);
      if (element.name == "vertex") {
        read_vertices(element, following);
        has_vertices = true;
      } else if (holds_faces(element) && has_vertices) {
        read_faces(element, following);
      } else {
        if (holds_faces(element)) later.emplace_back(&element, body_);
        for_each(element, following, [](std::size_t) { return false; });
      }
    }
    if (body_.rest().find_first_not_of(" \t\r\n") != std::string_view::npos) {
      notes_.add("What follows the last element is ignored", body_.line());
    }
    for (const auto& [element, body] : later) {
      body_ = body;
      read_faces(*element, 0);
    }
  }

  /// Calls `take(i)` for every property i of every element of the kind; where it doesn't take it, skips it.
  template <typename Take>
  void for_each(const PlyElement& element, std::uint64_t following, const Take& take) {
    if (element.properties.empty()) return;
    const std::uint64_t size = least_size(element);
    for (index_ = 0; index_ < element.count; ++index_) {
      steps_.take();
      body_.expect_after(following + (element.count - index_ - 1) * size);
      for (std::size_t i = 0; i < element.properties.size(); ++i) {
        if (take(i)) continue;
        const PlyProperty& property = element.properties[i];
        body_.skip(property.type, property.count_type ? list_length(element, property) : 1);
      }
    }
  }

  std::uint64_t list_length(const PlyElement& element, const PlyProperty& list) {
    const std::int64_t length = body_.integer(*list.count_type);
    if (length < 0 || length > std::numeric_limits<std::uint32_t>::max()) {
      fail(body_.line(),
           element.name + ' ' + std::to_string(index_) + " has a list of length " + std::to_string(length));
    }
    body_.need(list.type, static_cast<std::uint64_t>(length));
    return static_cast<std::uint64_t>(length);
  }

  void read_vertices(const PlyElement& element, std::uint64_t following) {
    mesh_.positions.resize(element.count);
    if (has_normals_) mesh_.normals.resize(element.count);
    if (is_textured()) attributes_.uvs[0].resize(element.count);
    if (has_corner_texcoords_) next_at_vertex_.resize(element.count, kUnused);
    vertices_ = element.count;
    if (has_colors_) attributes_.colors.resize(element.count, {1, 1, 1, 1});
    for (std::size_t i = 0; i < columns_.size(); ++i)
      if (columns_[i] >= kColor && columns_[i] < kNoColumn)
        color_types_[columns_[i] - kColor] = element.properties[i].type;
    for_each(element, following, [&](std::size_t i) {
      const std::size_t column = columns_[i];
      if (column == kNoColumn) return false;
      const float number = body_.number(element.properties[i].type);
      if (column < kNormal) {
        mesh_.positions[index_][static_cast<int>(column)] = number;
      } else if (column < kTexcoord) {
        mesh_.normals[index_][static_cast<int>(column - kNormal)] = number;
      } else if (column < kColor) {
        (column == kTexcoord ? attributes_.uvs[0][index_].x : attributes_.uvs[0][index_].y) = number;
      } else {
        attributes_.colors[index_][column - kColor] = number;
      }
      return true;
    });
  }

  /// From what is written to what `MeshAttributes` holds.
  void finish_attributes() {
    for (Vec2& uv : attributes_.uvs[0]) {
      const bool is_finite = std::isfinite(uv.x) && std::isfinite(uv.y);
      if (!is_finite) notes_.add("A texture coordinate that isn't finite counts as 0 0");
      uv = is_finite ? Vec2{uv.x, 1 - uv.y} : Vec2{0, 1};
    }
    if (!has_colors_) return;
    const std::array brightest{brightest_written(0), brightest_written(1), brightest_written(2), brightest_written(3)};
    for (std::size_t i = 0; i < (has_alpha_ ? 4U : 3U); ++i) {
      for (auto& color : attributes_.colors) {
        const double share = color[i] / brightest[i];
        color[i] = i < 3 ? light_of_encoded(share) : static_cast<float>(share > 0 ? std::min(share, 1.0) : 0);
      }
    }
    const auto alpha_of = [](const auto& color) { return color[3]; };
    if (std::ranges::all_of(
            attributes_.colors, [](float a) { return a == 0; }, alpha_of)) {
      notes_.add("An alpha that is 0 everywhere is taken for none");
      for (auto& color : attributes_.colors) color[3] = 1;
    }
    has_alpha_ = std::ranges::any_of(
        attributes_.colors, [](float a) { return a < 1; }, alpha_of);
  }

  /// The number that counts as 1 in colours; floats are up to 1, or else up to 255.
  double brightest_written(std::size_t channel) {
    const PlyScalar type = color_types_[channel];
    if (type < PlyScalar::float32) return brightest_of(type);
    const std::size_t first = channel < 3 ? 0 : 3, end = channel < 3 ? 3 : 4;
    for (const auto& color : attributes_.colors)
      for (std::size_t i = first; i < end; ++i)
        if (color_types_[i] >= PlyScalar::float32 && color[i] > 1) return 255;
    return 1;
  }

  void add_material(Imported& result) {
    Material material{.surface = Diffuse{{1, 1, 1}}};
    material.has_vertex_colors = has_colors_;
    material.has_vertex_alpha = has_alpha_;
    if (is_textured()) {
      material.textures.push_back({TextureSlot::base_color});
      result.textures.push_back({.image = texture_.image, .is_srgb = !texture_.is_linear});
    }
    result.materials.push_back(std::move(material));
    result.parts.back().material = 0;
  }

  void read_faces(const PlyElement& element, std::uint64_t following) {
    const bool are_strips = element.name == "tristrips";
    const auto list = static_cast<std::size_t>(
        std::find_if(element.properties.begin(), element.properties.end(), is_index_list) - element.properties.begin());
    const PlyProperty& property = element.properties[list];
    has_faces_ |= element.count > 0;
    const std::size_t last = element.properties.size() - 1;
    for_each(element, following, [&](std::size_t i) {
      const bool is_list = i == list;
      const bool is_texcoords = has_corner_texcoords_ && !are_strips && is_texcoord_list(element.properties[i]);
      if (is_list) read_corners(element, property);
      if (is_texcoords) read_texcoords(element, element.properties[i]);
      if (are_strips && is_list) add_strip();
      if (!are_strips && i == last) add_face();
      return is_list || is_texcoords;
    });
  }

  void read_corners(const PlyElement& element, const PlyProperty& list) {
    corners_.clear();
    is_lost_ = false;
    for (std::uint64_t left = list_length(element, list); left > 0; --left) {
      steps_.take();
      const std::int64_t index = body_.integer(list.type);
      if (element.name == "tristrips" && index == -1) {
        add_strip();
        corners_.clear();
      } else if (index < 0 || static_cast<std::uint64_t>(index) >= vertices_) {
        add_index_error(element, index);
        corners_.push_back(kNoVertex);
      } else {
        corners_.push_back(static_cast<std::uint32_t>(index));
      }
    }
  }

  void read_texcoords(const PlyElement& element, const PlyProperty& list) {
    texcoords_.clear();
    for (std::uint64_t left = list_length(element, list); left > 0; --left) {
      steps_.take();
      texcoords_.push_back(body_.number(list.type));
    }
  }

  /// Counts a loss, and keeps the first ones as errors: should nothing be left of the file, it is refused with them.
  void add_index_error(const PlyElement& element, std::int64_t index) {
    if (!is_lost_) notes_.add("A face that names a vertex that isn't there was dropped", body_.line());
    is_lost_ = true;
    if (errors_.size() == kMaxFieldErrors) return;
    errors_.push_back({file_place(file_name_, body_.line()),
                       element.name + ' ' + std::to_string(index_) + " names vertex " + std::to_string(index) +
                           ", but the file has " + std::to_string(vertices_) + ", counted from 0"});
  }

  void add_face() {
    if (corners_.size() < 3) {
      if (!is_lost_) notes_.add("A face with less than 3 corners was dropped", body_.line());
      return;
    }
    if (is_lost_) return;
    if (has_corner_texcoords_) give_texcoords();
    if (!triangulate(mesh_.positions, corners_, mesh_.triangles, steps_))
      note_lost_polygon(corners_.size(), notes_, body_.line());
  }

  /// To the face's corners, each of which gets a vertex that has its own.
  void give_texcoords() {
    const bool has_all = texcoords_.size() == 2 * corners_.size();
    if (!has_all) notes_.add("A face without texture coordinates for each corner has 0 0 there", body_.line());
    for (std::size_t i = 0; i < corners_.size(); ++i)
      corners_[i] = vertex_with(corners_[i], has_all ? Vec2{texcoords_[2 * i], texcoords_[2 * i + 1]} : Vec2{});
  }

  /// The file's vertex itself for the first ones that it is asked for, then copies, which are chained.
  std::uint32_t vertex_with(std::uint32_t vertex, Vec2 uv) {
    constexpr int kMostCopiesTried = 64;  // Sharing vertices only saves memory.
    std::vector<Vec2>& uvs = attributes_.uvs[0];
    if (next_at_vertex_[vertex] == kUnused) {
      next_at_vertex_[vertex] = kNoVertex;
      uvs[vertex] = uv;
      return vertex;
    }
    std::uint32_t at = vertex;
    for (int i = 0; at != kNoVertex && i < kMostCopiesTried; ++i, at = next_at_vertex_[at])
      if (uvs[at] == uv) return at;
    const auto added = static_cast<std::uint32_t>(uvs.size());
    uvs.push_back(uv);
    mesh_.positions.push_back(Vec3(mesh_.positions[vertex]));
    if (has_normals_) mesh_.normals.push_back(Vec3(mesh_.normals[vertex]));
    next_at_vertex_.push_back(std::exchange(next_at_vertex_[vertex], added));
    return added;
  }

  /// Triangles that name a vertex twice only turn the strip or join it to the next: they are no loss.
  void add_strip() {
    for (std::size_t i = 2; i < corners_.size(); ++i) {
      const std::uint32_t a = corners_[i - 2], b = corners_[i - 1], c = corners_[i];
      if (a == b || b == c || c == a || a == kNoVertex || b == kNoVertex || c == kNoVertex) continue;
      mesh_.triangles.push_back(i % 2 == 0 ? TriangleIndices{a, b, c} : TriangleIndices{b, a, c});
    }
  }

  static constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max(), kUnused = kNoVertex - 1;

  Steps steps_;
  const PlyHeader& header_;
  Body body_;
  std::string_view file_name_;
  TextureFiles::Opened texture_;  ///< Without an image where there is none.
  ImportNotes notes_;
  bool has_normals_ = false, has_colors_ = false, has_alpha_ = false;
  bool has_texcoords_ = false, has_corner_texcoords_ = false;  ///< That are wanted: of vertices, or of faces' corners.
  std::vector<std::size_t> columns_;                           ///< Of the vertices' properties.
  std::array<PlyScalar, 4> color_types_{};
  MeshAttributes attributes_;
  TriangleMesh mesh_;
  std::uint64_t vertices_ = 0;                 ///< Of the file.
  std::vector<std::uint32_t> next_at_vertex_;  ///< Of vertices that are copies of one, or it: chained.
  std::uint64_t index_ = 0;                    ///< Of the element that is being read.
  bool has_faces_ = false;                     ///< Whether there is a face, usable or not.
  bool is_lost_ = false;                       ///< The face, or a part of the strip, that is being read.
  std::vector<std::uint32_t> corners_;
  std::vector<float> texcoords_;  ///< Of the face's corners.
  std::vector<FieldError> errors_;
};

/// The image that the header names; null, with a note, where it isn't there or can't be used.
TextureFiles::Opened open_image(const PlyHeader& header, const CompanionSource& companions, std::uint64_t texture_bytes,
                                const std::stop_token& stop, ImportNotes& notes) {
  if (header.texture_files.empty()) return {};
  if (header.texture_files.size() > 1) notes.add("Of the textures that the file names the first one is used");
  const std::string& written = header.texture_files.front();
  std::optional<InputFile> file;
  TextureSearch search([&](const std::string& name) {
    const auto found = companions ? companions(name) : std::nullopt;
    if (found) file = *found;
    return found.has_value();
  });
  const std::string called = "The texture \"" + written.substr(0, 80) + '"';
  const auto name = search.look_for("", written);
  if (!name) {
    notes.add(called + " isn't there");
    return {};
  }
  TextureFiles files(texture_bytes, stop);
  TextureFiles::Opened opened = files.open(*file, *name);
  if (!opened.image) notes.add(called + " can't be used: " + opened.problem);
  return opened;
}

}  // namespace

Imported import_ply(std::string_view bytes, std::string_view file_name, const CompanionSource& companions,
                    std::stop_token stop, std::uint64_t texture_bytes) {
  const PlyHeader header = read_ply_header(bytes, file_name);
  ImportNotes notes(file_name);
  const auto image = open_image(header, companions, texture_bytes, stop, notes);
  if (header.encoding == PlyEncoding::ascii) {
    return PlyReader(header, PlyTextBody(bytes, header, file_name), file_name, image, std::move(notes), std::move(stop))
        .read();
  }
  return PlyReader(header, PlyBinaryBody(bytes, header, file_name), file_name, image, std::move(notes), std::move(stop))
      .read();
}

}  // namespace tessera::proto
