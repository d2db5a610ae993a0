#include "proto/import/obj.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "core/math/srgb.h"
#include "proto/import/broken_file.h"
#include "proto/import/import_notes.h"
#include "proto/import/mtl.h"
#include "proto/import/numbers.h"
#include "proto/import/obj_normals.h"
#include "proto/import/obj_part.h"
#include "proto/import/obj_text.h"
#include "proto/import/text_cursor.h"
#include "proto/wire/material_libraries.h"

namespace tessera::proto {
namespace {

/// A part takes some 700 bytes beside its faces, and as little as 13 in the file.
constexpr std::size_t kMostParts = 1 << 20;

/// A face's corner as it is written: indices from 1, or from −1 backwards; 0 for what isn't named.
struct WrittenCorner {
  std::int32_t position = 0, texcoord = 0, normal = 0;
  bool has_zero = false;  ///< A texture coordinate or a normal is written as 0.
};

/// Reads an index of up to 9 digits.
bool read_index(const char*& at, const char* end, std::int32_t& index) {
  const bool is_negative = at != end && *at == '-';
  if (at != end && (*at == '-' || *at == '+')) ++at;
  const char* const first = at;
  std::int32_t value = 0;
  for (; at != end && *at >= '0' && *at <= '9'; ++at) {
    if (at - first == 9) return false;
    value = 10 * value + (*at - '0');
  }
  index = is_negative ? -value : value;
  return at != first;
}

/// Reads v, v/vt, v//vn or v/vt/vn, up to a blank or the end. What follows a slash may be missing.
bool read_corner(const char*& at, const char* end, WrittenCorner& corner) {
  if (!read_index(at, end, corner.position)) return false;
  for (std::int32_t* const index : {&corner.texcoord, &corner.normal}) {
    if (at == end || *at != '/') break;
    ++at;
    if (at == end || *at == '/' || TextCursor::is_blank(*at)) continue;
    if (!read_index(at, end, *index)) return false;
    corner.has_zero |= *index == 0;
  }
  return at == end || TextCursor::is_blank(*at);
}

/// What can be told of a face or a vertex that is lost.
constexpr const char* kNoCorners = "A face whose corners aren't written v, v/vt, v//vn or v/vt/vn was dropped";
constexpr const char* kNoVertex = "A face that names a vertex that isn't there was dropped";
constexpr const char* kNoNumbers = "A vertex without three numbers costs the faces that use it";
constexpr const char* kUnusedIndex = "The index of a normal or a texture coordinate that isn't there was ignored";

constexpr std::array<float, 4> kWhite{1, 1, 1, 1};

class ObjReader {
 public:
  ObjReader(std::string text, std::string_view file_name, const CompanionSource& companions,
            std::uint64_t texture_bytes, std::stop_token stop)
      : steps_(std::move(stop)),
        text_(std::move(text), file_name, steps_),
        file_name_(file_name),
        notes_(file_name),
        libraries_(companions, texture_bytes, steps_.stop()) {}

  Imported read() {
    while (text_.next()) {
      steps_.take();
      read_line();
    }
    check_forward_references();
    return finish();
  }

 private:
  /// Names, by their numbers: a file may repeat a long one for every part.
  struct Key {
    std::uint32_t object = 0, group = 0, material = 0;
    auto operator<=>(const Key&) const = default;
  };
  struct Part {
    std::uint32_t material;
    ObjFaces faces;
  };
  struct ForwardReference {
    std::uint32_t position;  ///< From 0.
    std::size_t line;
  };

  void read_line() {
    TextCursor words(text_.current(), TextCursor::kNoComment);
    const std::string_view keyword = words.next(), arguments = trimmed(words.rest());
    if (keyword.empty() || keyword[0] == '#') return;
    if (keyword == "v") {
      read_position(words);
    } else if (keyword == "vn") {
      read_normal(words);
    } else if (keyword == "vt") {
      read_texcoord(words);
    } else if (keyword == "f") {
      add_face(arguments);
    } else if (keyword == "s") {
      read_smoothing_group(arguments);
    } else if (keyword == "o") {
      start_part(key_.object, arguments);
    } else if (keyword == "g") {
      start_part(key_.group, arguments);
    } else if (keyword == "usemtl") {
      start_part(key_.material, arguments);
      if (!arguments.empty()) used_.try_emplace(std::string(arguments), text_.line());
    } else if (is_mtllib(keyword)) {
      if (!arguments.empty() && !libraries_.load(arguments))
        notes_.add("A material library that is named here isn't there or can't be read", text_.line());
    } else {
      notes_.add("A statement other than v, vt, vn, f, o, g, s, usemtl and mtllib was ignored", text_.line());
    }
  }

  /// Counts a loss, and keeps the first ones as errors: should nothing be left of the file, it is refused with them.
  void lose(const char* what, std::size_t line, const std::string& why) {
    notes_.add(what, line);
    if (errors_.size() < kMaxFieldErrors) errors_.push_back({file_place(file_name_, line), why});
  }

  std::optional<Vec3> read_vector(TextCursor& words) {
    Vec3 v;
    for (int axis = 0; axis < 3; ++axis) {
      const std::optional<float> number = next_float(words);
      if (!number) return std::nullopt;
      v[axis] = *number;
    }
    return v;
  }

  void read_position(TextCursor& words) {
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    const std::optional<Vec3> position = read_vector(words);
    vertices_.positions.push_back(position.value_or(Vec3{kNone, kNone, kNone}));
    if (!position) {
      lose(kNoNumbers, text_.line(),
           words.ahead().empty() ? "Three numbers are expected here" : "A number is expected here");
    } else if (!words.ahead().empty()) {
      read_color(words);
    }
    if (!vertices_.colors.empty()) vertices_.colors.resize(vertices_.positions.size(), kWhite);
  }

  /// After a position. What programs write there is what they show.
  void read_color(TextCursor& words) {
    std::array<float, 4> color = kWhite;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::optional<float> number = next_float(words);
      if (!number) return notes_.add("What follows x y z, and is no colour, is ignored", text_.line());
      color[i] = *number;
    }
    brightest_ = std::max({brightest_, color[0], color[1], color[2]});
    if (!words.ahead().empty()) notes_.add("What follows x y z r g b is ignored", text_.line());
    vertices_.colors.resize(vertices_.positions.size(), kWhite);
    vertices_.colors.back() = color;
  }

  /// As they were written, 1 or 255 is the brightest; what isn't a number is black.
  void make_colors_linear() {
    const bool are_bytes = brightest_ > 1;
    if (are_bytes) notes_.add("Colours of vertices go beyond 1: 255 is taken for the brightest");
    for (std::array<float, 4>& color : vertices_.colors) {
      if (color == kWhite) continue;  // as those without one
      for (std::size_t i = 0; i < 3; ++i) color[i] = light_of_encoded(are_bytes ? color[i] / 255.0 : color[i]);
    }
  }

  void read_texcoord(TextCursor& words) {
    const std::optional<float> u = next_float(words);
    const std::optional<float> v = words.ahead().empty() ? 0.0F : next_float(words);
    const bool is_usable = u && v && std::isfinite(*u) && std::isfinite(*v);
    if (!is_usable) notes_.add("A texture coordinate without two numbers counts as 0 0", text_.line());
    vertices_.texcoords.push_back(is_usable ? Vec2{*u, 1 - *v} : Vec2{0, 1});
  }

  void read_normal(TextCursor& words) {
    const std::optional<Vec3> normal = read_vector(words);
    vertices_.normals.push_back(normal.value_or(Vec3{}));
    if (!normal) notes_.add("A normal without three numbers has no direction", text_.line());
  }

  void read_smoothing_group(std::string_view name) {
    const std::optional<std::uint32_t> number = parse_integer<std::uint32_t>(name);
    smoothing_group_ = number.value_or(name == "on" ? 1 : 0);
    if (!number && name != "on" && name != "off")
      notes_.add("A smoothing group that is neither a number nor off counts as off", text_.line());
  }

  void start_part(std::uint32_t& part_of_key, std::string_view name) {
    auto found = names_.find(name);
    if (found == names_.end()) found = names_.emplace(name, static_cast<std::uint32_t>(names_.size())).first;
    part_of_key = found->second;
    part_ = nullptr;
  }

  void add_face(std::string_view corners) {
    has_faces_ = true;
    written_.clear();
    const char* const end = corners.data() + corners.size();
    for (const char* at = corners.data(); at != end;) {
      if (!read_corner(at, end, written_.emplace_back())) {
        return lose(kNoCorners, text_.line(),
                    "A face's corners are written v, v/vt, v//vn or v/vt/vn, with whole numbers other than 0");
      }
      while (at != end && TextCursor::is_blank(*at)) ++at;
    }
    if (written_.size() < 3) return notes_.add("A face with less than 3 corners was dropped", text_.line());
    steps_.take(written_.size());
    if (!names_vertices()) return;
    ObjFaces& faces = current_faces();
    for (const WrittenCorner& corner : written_) {
      const std::uint32_t position = from_zero(corner.position, vertices_.positions.size());
      if (position >= vertices_.positions.size() &&
          (forward_.empty() || forward_.back().line != text_.line() || forward_.back().position < position))
        forward_.push_back({position, text_.line()});
      if (corner.has_zero) notes_.add(kUnusedIndex, text_.line());
      faces.corners.push_back({position, optional_index(corner.normal, vertices_.normals.size()),
                               optional_index(corner.texcoord, vertices_.texcoords.size())});
    }
    faces.sizes.push_back(static_cast<std::uint32_t>(written_.size()));
    faces.smoothing_groups.push_back(smoothing_group_);
  }

  /// Whether no corner names vertex 0 or one before the first; those that aren't there yet may come.
  bool names_vertices() {
    for (const WrittenCorner& corner : written_) {
      if (corner.position > 0 || (corner.position < 0 && is_there(corner.position, vertices_.positions.size())))
        continue;
      const std::string count = std::to_string(vertices_.positions.size());
      lose(kNoVertex, text_.line(),
           corner.position == 0
               ? "Vertex 0 is out of range: vertices are counted from 1"
               : "Vertex " + std::to_string(corner.position) + " is out of range: before this line there are " + count);
      return false;
    }
    return true;
  }

  /// Whether a negative index, counted back from `count`, is one.
  static bool is_there(std::int32_t index, std::size_t count) { return static_cast<std::size_t>(-index) <= count; }

  static std::uint32_t from_zero(std::int32_t index, std::size_t count) {
    return static_cast<std::uint32_t>(index > 0 ? index - 1 : static_cast<std::int64_t>(count) + index);
  }

  /// Of a normal or a texture coordinate, of which there are `count` so far.
  std::uint32_t optional_index(std::int32_t index, std::size_t count) {
    const bool is_lost = index < 0 && !is_there(index, count);
    if (is_lost) notes_.add(kUnusedIndex, text_.line());
    return index == 0 || is_lost ? ObjCorner::kNone : from_zero(index, count);
  }

  ObjFaces& current_faces() {
    if (part_ == nullptr) {
      const auto [found, is_new] = part_indices_.try_emplace(key_, parts_.size());
      if (is_new) parts_.push_back({key_.material, {{}, {}, {}, text_.line()}});
      if (parts_.size() > kMostParts) {
        throw BrokenFile{{{file_place(file_name_, text_.line()),
                           "The file has more than " + std::to_string(kMostParts) + " groups: join some"}}};
      }
      part_ = &parts_[found->second];
    }
    return part_->faces;
  }

  /// Files may name what comes later, so what wasn't there at its line is looked at again in the end.
  void check_forward_references() {
    std::size_t last_line = 0;
    for (const ForwardReference& reference : forward_) {
      if (reference.position < vertices_.positions.size() || reference.line == last_line) continue;
      last_line = reference.line;
      lose(kNoVertex, reference.line,
           "Vertex " + std::to_string(reference.position + 1ULL) + " is out of range: the file has " +
               std::to_string(vertices_.positions.size()));
    }
    if (last_line != 0) {
      for (Part& part : parts_) drop_faces_without_vertices(part.faces);
    }
    for (Part& part : parts_) {
      for (ObjCorner& corner : part.faces.corners) {
        forget_if_missing(corner.normal, vertices_.normals.size(), part.faces.line);
        forget_if_missing(corner.texcoord, vertices_.texcoords.size(), part.faces.line);
      }
    }
  }

  void forget_if_missing(std::uint32_t& index, std::size_t count, std::size_t line) {
    if (index == ObjCorner::kNone || index < count) return;
    index = ObjCorner::kNone;
    notes_.add(kUnusedIndex, line);
  }

  void drop_faces_without_vertices(ObjFaces& faces) const {
    ObjFaces kept{{}, {}, {}, faces.line};
    const ObjCorner* next = faces.corners.data();
    for (std::size_t i = 0; i < faces.sizes.size(); ++i) {
      const std::span corners(next, faces.sizes[i]);
      next += corners.size();
      if (!std::ranges::all_of(corners, [&](ObjCorner c) { return c.position < vertices_.positions.size(); })) continue;
      kept.corners.insert(kept.corners.end(), corners.begin(), corners.end());
      kept.sizes.push_back(faces.sizes[i]);
      kept.smoothing_groups.push_back(faces.smoothing_groups[i]);
    }
    faces = std::move(kept);
  }

  void note_unknown_materials() {
    const std::pair<const std::string, std::size_t>* first = nullptr;
    std::size_t unknown = 0;
    for (const auto& used : used_) {
      if (libraries_.find(used.first)) continue;
      ++unknown;
      if (first == nullptr || used.second < first->second) first = &used;
    }
    if (first == nullptr) return;
    const std::string others = unknown == 1 ? "" : ", nor " + std::to_string(unknown - 1) + " others";
    notes_.add("No material library has the material \"" + first->first.substr(0, 80) + '"' + others, first->second);
  }

  Imported finish() {
    std::vector<ObjFaces*> meshes;
    for (Part& part : parts_) meshes.push_back(&part.faces);
    std::vector<std::optional<std::uint32_t>> materials(names_.size());
    for (const auto& [name, number] : names_) materials[number] = libraries_.find(name);
    std::set<std::uint32_t> used;
    for (const Part& part : parts_)
      if (const auto material = materials[part.material]) used.insert(*material);
    libraries_.finish(used);
    make_colors_linear();
    complete_normals(meshes, vertices_.positions, vertices_.normals, steps_);
    Imported result;
    ObjMeshMaker maker(vertices_, notes_, steps_);
    for (Part& part : parts_) {
      const ObjFaces faces = std::exchange(part.faces, {});
      const std::optional<std::uint32_t> material = materials[part.material];
      TriangleMesh mesh = maker.make(faces, material && !libraries_.materials[*material].textures.empty());
      if (mesh.triangles.empty()) continue;
      const bool has_colors = mesh.attributes && !mesh.attributes->colors.empty();
      result.parts.push_back({std::move(mesh), has_colors ? colored(material) : material});
    }
    if (result.parts.empty()) {
      notes_.add("The file has no triangles");
      if (has_faces_) refuse();
    } else {
      note_unknown_materials();
    }
    result.materials = std::move(libraries_.materials);
    result.textures = std::move(libraries_.textures);
    result.warnings = notes_.warnings();
    result.warnings.insert(result.warnings.end(), libraries_.warnings.begin(), libraries_.warnings.end());
    return result;
  }

  /// The material, or a white one, that the colours of vertices tint.
  std::uint32_t colored(std::optional<std::uint32_t> material) {
    std::vector<Material>& materials = libraries_.materials;
    const auto [known, is_new] = colored_.try_emplace(material, static_cast<std::uint32_t>(materials.size()));
    if (is_new) {
      Material copy = material ? materials[*material] : Material{.surface = Diffuse{{1, 1, 1}}};
      copy.has_vertex_colors = true;
      materials.push_back(std::move(copy));
    }
    return known->second;
  }

  /// Nothing is left of the file's faces.
  [[noreturn]] void refuse() {
    if (errors_.empty()) {
      for (const SceneWarning& warning : notes_.warnings()) errors_.push_back({warning.pointer, warning.detail});
    }
    throw BrokenFile{std::move(errors_)};
  }

  Steps steps_;
  ObjText text_;
  std::string_view file_name_;
  ImportNotes notes_;
  MtlLibraries libraries_;
  ObjVertices vertices_;
  float brightest_ = 0;  ///< Of the colours of vertices.
  std::uint32_t smoothing_group_ = 0;
  bool has_faces_ = false;  ///< Whether there is a face, usable or not.
  std::map<std::string, std::uint32_t, std::less<>> names_{{"", 0}};
  Key key_;
  std::map<Key, std::size_t> part_indices_;
  std::vector<Part> parts_;
  Part* part_ = nullptr;                     ///< Of `key_`; null until its next face.
  std::map<std::string, std::size_t> used_;  ///< Materials, and where they are named first.
  std::vector<WrittenCorner> written_;       ///< Of the face that is being read.
  std::vector<ForwardReference> forward_;    ///< To vertices that weren't there at their line.
  std::vector<FieldError> errors_;
  std::map<std::optional<std::uint32_t>, std::uint32_t> colored_;  ///< Copies of materials, by these.
};

}  // namespace

Imported import_obj(std::string text, std::string_view file_name, const CompanionSource& companions,
                    std::stop_token stop, std::uint64_t texture_bytes) {
  return ObjReader(std::move(text), file_name, companions, texture_bytes, std::move(stop)).read();
}

}  // namespace tessera::proto
