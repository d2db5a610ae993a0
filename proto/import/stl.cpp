#include "proto/import/stl.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "proto/import/broken_file.h"
#include "proto/import/import_notes.h"
#include "proto/import/mesh_repair.h"
#include "proto/import/numbers.h"
#include "proto/import/obj_text.h"
#include "proto/import/polygon.h"
#include "proto/import/shared_points.h"
#include "proto/import/text_cursor.h"
#include "proto/wire/abandoned.h"

namespace tessera::proto {
namespace {

constexpr std::size_t kHeader = 84;    ///< 80 bytes of anything, and the count.
constexpr std::size_t kTriangle = 50;  ///< A normal, three corners, and two bytes to spare.

std::uint32_t little32(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Binary files have a 0 there, if only in the count, or in a coordinate.
bool begins_as_text(std::string_view bytes) {
  if (bytes.starts_with(kByteOrderMark)) bytes.remove_prefix(kByteOrderMark.size());
  bytes.remove_prefix(std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size()));
  return lower_case(bytes.substr(0, 5)) == "solid" && bytes.substr(0, 512).find('\0') == bytes.npos;
}

class StlReader {
 public:
  StlReader(std::string_view bytes, std::string_view file_name, std::stop_token stop)
      : bytes_(bytes), file_name_(file_name), steps_(std::move(stop)), notes_(file_name) {}

  Imported read() {
    const bool has_header = bytes_.size() >= kHeader;
    const std::uint64_t binary_size = has_header ? kHeader + std::uint64_t{kTriangle} * little32(bytes_, 80) : 0;
    if (binary_size != bytes_.size() && begins_as_text(bytes_)) {
      read_text();
    } else {
      read_binary(binary_size);
    }
    mesh_.positions = points_.take();
    repair_mesh(mesh_, notes_);

    Imported result;
    if (mesh_.triangles.empty()) {
      notes_.add("The file has no triangles");
      if (has_facets_) refuse();
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

  /// Nothing is left of the file's facets.
  [[noreturn]] void refuse() const {
    BrokenFile broken;
    for (const SceneWarning& warning : notes_.warnings()) broken.errors.push_back({warning.pointer, warning.detail});
    throw broken;
  }

  void read_binary(std::uint64_t size) {
    if (size == 0) fail(0, "An STL file that isn't text has a header of 84 bytes, and this one ends before");
    const std::uint32_t count = little32(bytes_, 80);
    if (size > bytes_.size()) {
      fail(0, "The file is cut off: at byte 80 it counts " + std::to_string(count) + " triangles, of which " +
                  std::to_string((bytes_.size() - kHeader) / kTriangle) + " are there");
    }
    if (size < bytes_.size())
      notes_.add("What follows the last triangle, from byte " + std::to_string(size) + ", is ignored");
    has_facets_ = count > 0;
    mesh_.triangles.reserve(count);
    std::uint64_t spare = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      steps_.take();
      const std::size_t at = kHeader + kTriangle * std::size_t{i};
      TriangleIndices triangle;
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const auto coordinate = [&](std::size_t axis) {
          return std::bit_cast<float>(little32(bytes_, at + 12 * (corner + 1) + 4 * axis));
        };
        triangle[corner] = points_.number({coordinate(0), coordinate(1), coordinate(2)});
      }
      mesh_.triangles.push_back(triangle);
      spare += bytes_[at + 48] != 0 || bytes_[at + 49] != 0 ? 1 : 0;
    }
    notes_.add("What a triangle says beside its corners (a colour, in some programs' files) was ignored", 0, spare);
  }

  void read_text() {
    std::string with_line_feeds;
    if (bytes_.find('\n') == bytes_.npos) {  // of a system that ends lines otherwise
      with_line_feeds = bytes_;
      std::ranges::replace(with_line_feeds, '\r', '\n');
      bytes_ = with_line_feeds;
    }
    if (bytes_.starts_with(kByteOrderMark)) bytes_.remove_prefix(kByteOrderMark.size());
    TextCursor words(bytes_, TextCursor::kNoComment);
    bool is_solid = false;
    for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
      steps_.take();
      const std::string keyword = lower_case(word.substr(0, 16));
      if (keyword == "vertex") {
        read_vertex(words);
      } else if (keyword == "endloop") {
        end_loop(words.line());
      } else if (keyword == "facet" || keyword == "outer" || keyword == "endfacet") {
        drop_open_loop(words.line());
      } else if (keyword == "normal") {
        pass_words(words, 3, {"outer", "vertex"});
      } else if (keyword == "solid" || keyword == "endsolid") {
        is_solid = keyword == "solid";
        pass_words(words, bytes_.size(), {"facet", "solid"});
      } else if (keyword != "loop") {
        notes_.add("A statement that STL doesn't have was ignored", words.line());
        pass_words(words, bytes_.size(), {});
      }
    }
    drop_open_loop(words.line());
    if (is_solid) notes_.add("The file ends before its solid does", words.line());
  }

  /// Passes over at most so many words of the line, up to one of `ends`.
  static void pass_words(TextCursor& words, std::size_t most, std::initializer_list<std::string_view> ends) {
    for (; most > 0; --most) {
      TextCursor ahead = words;
      const std::string_view word = ahead.next_on_line();
      if (word.empty() || std::ranges::find(ends, lower_case(word.substr(0, 16))) != ends.end()) return;
      words = ahead;
    }
  }

  void read_vertex(TextCursor& words) {
    Vec3 point;
    for (int axis = 0; axis < 3; ++axis) {
      const std::optional<float> number = next_float(words);
      if (!number) fail(words.line(), "Three numbers are expected after \"vertex\"");
      point[axis] = *number;
    }
    has_facets_ = true;
    corners_.push_back(points_.number(point));
  }

  void end_loop(std::size_t line) {
    if (corners_.size() < 3) {
      notes_.add("A facet with less than 3 corners was dropped", line);
    } else if (!triangulate(points_.points(), corners_, mesh_.triangles, steps_)) {
      note_lost_polygon(corners_.size(), notes_, line);
    }
    corners_.clear();
  }

  void drop_open_loop(std::size_t line) {
    if (!corners_.empty()) notes_.add("A facet that has no \"endloop\" was dropped", line);
    corners_.clear();
  }

  std::string_view bytes_;
  std::string_view file_name_;
  Steps steps_;
  ImportNotes notes_;
  SharedPoints points_;
  TriangleMesh mesh_;
  bool has_facets_ = false;  ///< Whether there is a facet, usable or not.
  std::vector<std::uint32_t> corners_;
};

}  // namespace

Imported import_stl(std::string_view bytes, std::string_view file_name, std::stop_token stop) {
  return StlReader(bytes, file_name, std::move(stop)).read();
}

}  // namespace tessera::proto
