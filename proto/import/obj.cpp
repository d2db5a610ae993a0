#include "proto/import/obj.h"

#include <istream>
#include <map>
#include <tuple>
#include <utility>

#include <tiny_obj_loader.h>

#include "proto/import/broken_file.h"
#include "proto/import/import_notes.h"
#include "proto/import/mtl.h"
#include "proto/import/numbers.h"
#include "proto/import/obj_part.h"
#include "proto/import/obj_text.h"
#include "proto/import/text_cursor.h"

namespace tessera::proto {
namespace {

/// A part takes some 700 bytes beside its faces, and as little as 13 in the file.
constexpr std::size_t kMostParts = 1 << 20;

bool is_blank(char c) { return c == ' ' || c == '\t'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Whether corners are written v, v/vt, v//vn or v/vt/vn, with indices of up to 9 digits other than 0. The loader
/// makes a 0 of everything else, and wraps what overflows.
bool are_corners(std::string_view text) {
  int digits = 0, slashes = 0;
  bool is_zero = true;
  char before = ' ';
  for (const char c : text) {
    if (is_digit(c)) {
      if (++digits > 9) return false;
      is_zero &= c == '0';
    } else if (is_blank(c) || c == '/') {
      const bool may_be_empty = is_blank(c) ? is_blank(before) : before == '/' && slashes == 1;
      if (digits == 0 ? !may_be_empty : is_zero) return false;
      slashes = is_blank(c) ? 0 : slashes + 1;
      if (slashes > 2) return false;
      digits = 0;
      is_zero = true;
    } else if ((c != '-' && c != '+') || !(is_blank(before) || before == '/')) {
      return false;
    }
    before = c;
  }
  return digits > 0 ? !is_zero : is_blank(before);
}

/// The text after a line's keyword.
std::string_view arguments(std::string_view line) {
  line = trimmed(line);
  return line.substr(std::min(line.find_first_of(" \t"), line.size()));
}

class ObjReader : public tinyobj::MaterialReader {
 public:
  ObjReader(std::string text, std::string_view file_name, const CompanionSource& companions)
      : text_(std::move(text), file_name), file_name_(file_name), notes_(file_name), libraries_(companions) {}

  Imported read() {
    tinyobj::callback_t callbacks;
    callbacks.vertex_cb = [](void* self, float, float, float, float) { of(self).add_position(); };
    callbacks.normal_cb = [](void* self, float, float, float) { of(self).add_normal(); };
    callbacks.texcoord_cb = [](void* self, float, float, float) { of(self).add_texcoord(); };
    callbacks.index_cb = [](void* self, tinyobj::index_t* corners, int count) { of(self).add_face(corners, count); };
    callbacks.usemtl_cb = [](void* self, const char* name, int) { of(self).use_material(name); };
    callbacks.group_cb = [](void* self, const char** names, int count) { of(self).start_group(names, count); };
    callbacks.object_cb = [](void* self, const char* name) { of(self).start_object(name); };

    std::istream stream(&text_);
    tinyobj::LoadObjWithCallback(stream, callbacks, this, this);
    text_.finish([&](std::string_view line) { note_skipped(line); });
    check_forward_references();
    if (!errors_.empty()) throw BrokenFile{std::move(errors_)};
    return finish();
  }

  /// The loader asks once for every blank-separated word of a mtllib statement; the first time does.
  bool operator()(const std::string&, std::vector<tinyobj::material_t>*, std::map<std::string, int>*, std::string*,
                  std::string*) override {
    const std::size_t before = text_.line();
    follow();
    if (text_.line() != before && !libraries_.load(arguments(text_.current()))) {
      notes_.add("A material library that is named here isn't there or can't be read", text_.line());
    }
    return false;
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

  static ObjReader& of(void* self) { return *static_cast<ObjReader*>(self); }

  void follow() {
    text_.follow([&](std::string_view line) { note_skipped(line); });
  }

  void note_skipped(std::string_view line) {
    const std::string_view text = trimmed(line);
    if (text.empty() || text[0] == '#') return;
    const std::string_view keyword = text.substr(0, text.find_first_of(" \t"));
    if (keyword == "s" || keyword == "mtllib") return;
    // Without a name these three are no callback's.
    if (keyword == "o") return start_part(key_.object, "");
    if (keyword == "g") return start_part(key_.group, "");
    if (keyword == "usemtl") return start_part(key_.material, "");
    if (keyword == "v" || keyword == "vn" || keyword == "vt" || keyword == "f") {
      return add_error("This line has no numbers");
    }
    notes_.add("A statement other than v, vt, vn, f, o, g, s, usemtl and mtllib was ignored", text_.line());
  }

  void add_error(std::string detail) { add_error_at(text_.line(), std::move(detail)); }
  void add_error_at(std::size_t line, std::string detail) {
    errors_.push_back({file_place(file_name_, line), std::move(detail)});
    if (errors_.size() == kMaxFieldErrors) throw BrokenFile{std::move(errors_)};
  }

  /// The line's first three numbers, read again: the loader makes 0 of NaN, and 3.1 of "3.1+e2".
  Vec3 vector() {
    follow();
    TextCursor words(arguments(text_.current()), TextCursor::kNoComment);
    Vec3 v;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = words.next();
      const std::optional<float> number = parse_float(word);
      if (!number) {
        add_error(word.empty() ? "Three numbers are expected here"
                               : "A number is expected here, not \"" + std::string(word.substr(0, 40)) + '"');
        break;
      }
      v[axis] = *number;
    }
    if (!words.next().empty()) notes_.add("What follows x y z (a weight, or a colour) is ignored", text_.line());
    return v;
  }

  void add_position() { positions_.push_back(vector()); }
  void add_normal() { normals_.push_back(vector()); }

  void add_texcoord() {
    follow();
    ++texcoords_;
  }

  void start_object(std::string_view name) {
    follow();
    start_part(key_.object, trimmed(name));
  }

  void start_group(const char** names, int count) {
    follow();
    std::string group;
    for (int i = 0; i < count; ++i) group.append(names[i]).append(1, ' ');
    start_part(key_.group, group);
  }

  void use_material(std::string_view name) {
    follow();
    start_part(key_.material, trimmed(name));
    used_.try_emplace(key_.material, text_.line());
  }

  void start_part(std::string& part_of_key, std::string_view value) {
    part_of_key = value;
    part_ = nullptr;
  }

  void add_face(const tinyobj::index_t* corners, int count) {
    follow();
    if (!are_corners(arguments(text_.current()))) {
      return add_error("A face's corners are written v, v/vt, v//vn or v/vt/vn, with whole numbers other than 0");
    }
    if (count < 3) return notes_.add("A face with less than 3 corners was dropped", text_.line());
    ObjFaces& faces = current_faces();
    for (int i = 0; i < count; ++i) {
      const tinyobj::index_t& corner = corners[i];
      const auto position = resolve(kPosition, corner.vertex_index, positions_.size());
      if (corner.texcoord_index != 0) resolve(kTexcoord, corner.texcoord_index, texcoords_);
      const bool has_normal = corner.normal_index != 0;
      faces.corners.push_back(
          {position, has_normal ? resolve(kNormal, corner.normal_index, normals_.size()) : ObjCorner::kNoNormal});
    }
    faces.sizes.push_back(static_cast<std::uint32_t>(count));
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
  std::uint32_t resolve(Kind kind, int index, std::size_t count) {
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
  std::vector<ForwardReference> forward_;
  std::vector<FieldError> errors_;
};

}  // namespace

Imported import_obj(std::string text, std::string_view file_name, const CompanionSource& companions) {
  return ObjReader(std::move(text), file_name, companions).read();
}

}  // namespace tessera::proto
