#include "proto/import/obj.h"

#include <cstdint>
#include <map>
#include <utility>

#include "proto/import/broken_file.h"
#include "proto/import/import_notes.h"
#include "proto/import/mtl.h"
#include "proto/import/numbers.h"
#include "proto/import/obj_part.h"
#include "proto/import/obj_text.h"
#include "proto/import/text_cursor.h"
#include "proto/wire/material_libraries.h"

namespace tessera::proto {
namespace {

/// A part takes some 700 bytes beside its faces, and as little as 13 in the file.
constexpr std::size_t kMostParts = 1 << 20;

/// A face's corner as it is written: indices from 1, or from −1 backwards; 0 where there is none.
struct WrittenCorner {
  std::int32_t position = 0, texcoord = 0, normal = 0;
};

/// Reads an index of up to 9 digits other than 0.
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
  return value != 0;
}

/// Reads v, v/vt, v//vn or v/vt/vn, up to a blank or the end.
bool read_corner(const char*& at, const char* end, WrittenCorner& corner) {
  const auto passes_slash = [&] { return at != end && *at == '/' && (++at, true); };
  if (!read_index(at, end, corner.position)) return false;
  if (passes_slash()) {
    const bool skips_texcoord = at != end && *at == '/';
    if (!skips_texcoord && !read_index(at, end, corner.texcoord)) return false;
    if (passes_slash() && !read_index(at, end, corner.normal)) return false;
  }
  return at == end || TextCursor::is_blank(*at);
}

class ObjReader {
 public:
  ObjReader(std::string text, std::string_view file_name, const CompanionSource& companions)
      : text_(std::move(text), file_name), file_name_(file_name), notes_(file_name), libraries_(companions) {}

  Imported read() {
    while (text_.next()) read_line();
    check_forward_references();
    if (!errors_.empty()) throw BrokenFile{std::move(errors_)};
    return finish();
  }

 private:
  struct Key {
    std::string object, group, material;
    auto operator<=>(const Key&) const = default;
  };
  struct Part {
    std::string material;
    ObjFaces faces;
  };
  enum Kind { kPosition, kTexcoord, kNormal };
  struct ForwardReference {
    Kind kind;
    std::uint32_t index;  ///< From 0.
    std::size_t line;
  };

  void read_line() {
    TextCursor words(text_.current(), TextCursor::kNoComment);
    const std::string_view keyword = words.next(), arguments = trimmed(words.rest());
    if (keyword.empty() || keyword[0] == '#' || keyword == "s") return;
    if (keyword == "v" || keyword == "f" || keyword == "vn" || keyword == "vt") {
      if (arguments.empty()) return add_error("This line has no numbers");
      if (keyword == "v") return positions_.push_back(read_vector(words));
      if (keyword == "f") return add_face(arguments);
      if (keyword == "vn") return normals_.push_back(read_vector(words));
      ++texcoords_;
    } else if (keyword == "o") {
      start_part(key_.object, arguments);
    } else if (keyword == "g") {
      start_part(key_.group, arguments);
    } else if (keyword == "usemtl") {
      start_part(key_.material, arguments);
      if (!arguments.empty()) used_.try_emplace(key_.material, text_.line());
    } else if (is_mtllib(keyword)) {
      if (!arguments.empty() && !libraries_.load(arguments))
        notes_.add("A material library that is named here isn't there or can't be read", text_.line());
    } else {
      notes_.add("A statement other than v, vt, vn, f, o, g, s, usemtl and mtllib was ignored", text_.line());
    }
  }

  void add_error(std::string detail) { add_error_at(text_.line(), std::move(detail)); }
  void add_error_at(std::size_t line, std::string detail) {
    errors_.push_back({file_place(file_name_, line), std::move(detail)});
    if (errors_.size() == kMaxFieldErrors) throw BrokenFile{std::move(errors_)};
  }

  Vec3 read_vector(TextCursor& words) {
    Vec3 v;
    for (int axis = 0; axis < 3; ++axis) {
      const std::optional<float> number = next_float(words);
      if (!number) {
        const std::string_view word = words.next();
        add_error(word.empty() ? "Three numbers are expected here"
                               : "A number is expected here, not \"" + std::string(word.substr(0, 40)) + '"');
        return v;
      }
      v[axis] = *number;
    }
    if (!words.ahead().empty()) notes_.add("What follows x y z (a weight, or a colour) is ignored", text_.line());
    return v;
  }

  void start_part(std::string& part_of_key, std::string_view value) {
    part_of_key = value;
    part_ = nullptr;
  }

  void add_face(std::string_view corners) {
    written_.clear();
    const char* const end = corners.data() + corners.size();
    for (const char* at = corners.data(); at != end;) {
      if (!read_corner(at, end, written_.emplace_back()))
        return add_error("A face's corners are written v, v/vt, v//vn or v/vt/vn, with whole numbers other than 0");
      while (at != end && TextCursor::is_blank(*at)) ++at;
    }
    if (written_.size() < 3) return notes_.add("A face with less than 3 corners was dropped", text_.line());
    ObjFaces& faces = current_faces();
    for (const WrittenCorner& corner : written_) {
      const std::uint32_t position = resolve(kPosition, corner.position, positions_.size());
      if (corner.texcoord != 0) resolve(kTexcoord, corner.texcoord, texcoords_);
      const bool has_normal = corner.normal != 0;
      faces.corners.push_back(
          {position, has_normal ? resolve(kNormal, corner.normal, normals_.size()) : ObjCorner::kNoNormal});
    }
    faces.sizes.push_back(static_cast<std::uint32_t>(written_.size()));
  }

  ObjFaces& current_faces() {
    if (part_ == nullptr) {
      const auto [found, is_new] = part_indices_.try_emplace(key_, parts_.size());
      if (is_new) parts_.push_back({key_.material, {{}, {}, text_.line()}});
      if (parts_.size() > kMostParts) {
        add_error("The file has more than " + std::to_string(kMostParts) + " groups: join some");
        throw BrokenFile{std::move(errors_)};
      }
      part_ = &parts_[found->second];
    }
    return part_->faces;
  }

  /// From 0. Files may name what comes later, so an index beyond what is there yet is looked at again in the end.
  std::uint32_t resolve(Kind kind, std::int32_t index, std::size_t count) {
    if (index > 0) {
      const auto from_zero = static_cast<std::uint32_t>(index - 1);
      if (from_zero >= count) forward_.push_back({kind, from_zero, text_.line()});
      return from_zero;
    }
    if (static_cast<std::size_t>(-index) > count) {
      add_error(what(kind) + ' ' + std::to_string(index) + " is out of range: before this line there are " +
                std::to_string(count));
      return 0;
    }
    return static_cast<std::uint32_t>(count - static_cast<std::size_t>(-index));
  }

  static std::string what(Kind kind) {
    return kind == kPosition ? "Vertex" : kind == kNormal ? "Normal" : "Texture coordinate";
  }

  void check_forward_references() {
    const std::size_t counts[] = {positions_.size(), texcoords_, normals_.size()};
    std::size_t last_line = 0;
    for (const ForwardReference& reference : forward_) {
      if (reference.index < counts[reference.kind] || reference.line == last_line) continue;
      last_line = reference.line;
      add_error_at(reference.line, what(reference.kind) + ' ' + std::to_string(reference.index + 1ULL) +
                                       " is out of range: the file has " + std::to_string(counts[reference.kind]));
    }
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
    Imported result;
    ObjMeshMaker maker(positions_, normals_, notes_);
    for (Part& part : parts_) {
      const ObjFaces faces = std::exchange(part.faces, {});
      TriangleMesh mesh = maker.make(faces);
      if (!mesh.triangles.empty()) result.parts.push_back({std::move(mesh), libraries_.find(part.material)});
    }
    note_unknown_materials();
    if (result.parts.empty()) notes_.add("The file has no triangles");
    result.materials = std::move(libraries_.materials);
    result.warnings = notes_.warnings();
    result.warnings.insert(result.warnings.end(), libraries_.warnings.begin(), libraries_.warnings.end());
    return result;
  }

  ObjText text_;
  std::string_view file_name_;
  ImportNotes notes_;
  MtlLibraries libraries_;
  std::vector<Vec3> positions_, normals_;
  std::size_t texcoords_ = 0;
  Key key_;
  std::map<Key, std::size_t> part_indices_;
  std::vector<Part> parts_;
  Part* part_ = nullptr;                     ///< Of `key_`; null until its next face.
  std::map<std::string, std::size_t> used_;  ///< Materials, and where they are named first.
  std::vector<WrittenCorner> written_;       ///< Of the face that is being read.
  std::vector<ForwardReference> forward_;
  std::vector<FieldError> errors_;
};

}  // namespace

Imported import_obj(std::string text, std::string_view file_name, const CompanionSource& companions) {
  return ObjReader(std::move(text), file_name, companions).read();
}

}  // namespace tessera::proto
