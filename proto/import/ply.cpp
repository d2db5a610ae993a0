#include "proto/import/ply.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "proto/import/broken_file.h"
#include "proto/import/import_notes.h"
#include "proto/import/mesh_repair.h"
#include "proto/import/ply_body.h"
#include "proto/import/ply_header.h"
#include "proto/import/polygon.h"

namespace tessera::proto {
namespace {

bool is_index_list(const PlyProperty& p) { return p.name == "vertex_indices" || p.name == "vertex_index"; }

/// The coordinate that a vertex property holds: 0..2 of the position, 3..5 of the normal; 6 for none.
std::size_t coordinate_of(const PlyProperty& p) {
  constexpr std::array<std::string_view, 6> kNames{"x", "y", "z", "nx", "ny", "nz"};
  if (p.count_type) return kNames.size();
  return static_cast<std::size_t>(std::find(kNames.begin(), kNames.end(), p.name) - kNames.begin());
}

template <typename Body>
class PlyReader {
 public:
  PlyReader(const PlyHeader& header, Body body, std::string_view file_name, std::stop_token stop)
      : steps_(std::move(stop)), header_(header), body_(body), file_name_(file_name), notes_(file_name) {}

  Imported read() {
    check_header();
    read_elements();

    Imported result;
    repair_mesh(mesh_, notes_);
    if (mesh_.triangles.empty()) {
      notes_.add("The file has no triangles");
      if (has_faces_) refuse();
    } else {
      result.parts.push_back({std::move(mesh_), std::nullopt});
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

  void check_vertex(const PlyElement& vertex) {
    std::array<bool, 7> has{};
    std::string unused;
    for (const PlyProperty& property : vertex.properties) has[coordinate_of(property)] = true;
    if (!has[0] || !has[1] || !has[2]) fail(vertex.line, "The element \"vertex\" needs properties x, y and z");
    has_normals_ = has[3] && has[4] && has[5];
    for (const PlyProperty& property : vertex.properties) {
      if (coordinate_of(property) >= (has_normals_ ? 6U : 3U)) unused += ' ' + property.name;
    }
    note_unused(vertex, unused);
  }

  void check_faces(const PlyElement& faces) {
    std::size_t lists = 0;
    std::string unused;
    for (const PlyProperty& property : faces.properties) {
      if (!is_index_list(property)) {
        unused += ' ' + property.name;
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
    std::vector<std::size_t> coordinates;
    for (const PlyProperty& property : element.properties) coordinates.push_back(coordinate_of(property));
    for_each(element, following, [&](std::size_t i) {
      const std::size_t coordinate = coordinates[i];
      if (coordinate >= (has_normals_ ? 6U : 3U)) return false;
      Vec3& target = coordinate < 3 ? mesh_.positions[index_] : mesh_.normals[index_];
      target[static_cast<int>(coordinate % 3)] = body_.number(element.properties[i].type);
      return true;
    });
  }

  void read_faces(const PlyElement& element, std::uint64_t following) {
    const bool are_strips = element.name == "tristrips";
    const auto list = static_cast<std::size_t>(
        std::find_if(element.properties.begin(), element.properties.end(), is_index_list) - element.properties.begin());
    const PlyProperty& property = element.properties[list];
    has_faces_ |= element.count > 0;
    for_each(element, following, [&](std::size_t i) {
      if (i != list) return false;
      corners_.clear();
      is_lost_ = false;
      for (std::uint64_t left = list_length(element, property); left > 0; --left) {
        steps_.take();
        const std::int64_t index = body_.integer(property.type);
        if (are_strips && index == -1) {
          add_strip();
          corners_.clear();
        } else if (index < 0 || static_cast<std::uint64_t>(index) >= mesh_.positions.size()) {
          add_index_error(element, index);
          corners_.push_back(kNoVertex);
        } else {
          corners_.push_back(static_cast<std::uint32_t>(index));
        }
      }
      are_strips ? add_strip() : add_face();
      return true;
    });
  }

  /// Counts a loss, and keeps the first ones as errors: should nothing be left of the file, it is refused with them.
  void add_index_error(const PlyElement& element, std::int64_t index) {
    if (!is_lost_) notes_.add("A face that names a vertex that isn't there was dropped", body_.line());
    is_lost_ = true;
    if (errors_.size() == kMaxFieldErrors) return;
    errors_.push_back({file_place(file_name_, body_.line()),
                       element.name + ' ' + std::to_string(index_) + " names vertex " + std::to_string(index) +
                           ", but the file has " + std::to_string(mesh_.positions.size()) + ", counted from 0"});
  }

  void add_face() {
    if (corners_.size() < 3) {
      if (!is_lost_) notes_.add("A face with less than 3 corners was dropped", body_.line());
      return;
    }
    if (is_lost_) return;
    if (!triangulate(mesh_.positions, corners_, mesh_.triangles, steps_))
      note_lost_polygon(corners_.size(), notes_, body_.line());
  }

  /// Triangles that name a vertex twice only turn the strip or join it to the next: they are no loss.
  void add_strip() {
    for (std::size_t i = 2; i < corners_.size(); ++i) {
      const std::uint32_t a = corners_[i - 2], b = corners_[i - 1], c = corners_[i];
      if (a == b || b == c || c == a || a == kNoVertex || b == kNoVertex || c == kNoVertex) continue;
      mesh_.triangles.push_back(i % 2 == 0 ? TriangleIndices{a, b, c} : TriangleIndices{b, a, c});
    }
  }

  static constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();

  Steps steps_;
  const PlyHeader& header_;
  Body body_;
  std::string_view file_name_;
  ImportNotes notes_;
  bool has_normals_ = false;
  TriangleMesh mesh_;
  std::uint64_t index_ = 0;  ///< Of the element that is being read.
  bool has_faces_ = false;   ///< Whether there is a face, usable or not.
  bool is_lost_ = false;     ///< The face, or a part of the strip, that is being read.
  std::vector<std::uint32_t> corners_;
  std::vector<FieldError> errors_;
};

}  // namespace

Imported import_ply(std::string_view bytes, std::string_view file_name, std::stop_token stop) {
  const PlyHeader header = read_ply_header(bytes, file_name);
  if (header.encoding == PlyEncoding::ascii) {
    return PlyReader(header, PlyTextBody(bytes, header, file_name), file_name, std::move(stop)).read();
  }
  return PlyReader(header, PlyBinaryBody(bytes, header, file_name), file_name, std::move(stop)).read();
}

}  // namespace tessera::proto
