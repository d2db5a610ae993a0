#include "proto/import/ply_header.h"

#include <algorithm>
#include <array>
#include <utility>

#include "proto/import/broken_file.h"
#include "proto/import/numbers.h"
#include "proto/import/text_cursor.h"
#include "proto/wire/material_textures.h"

namespace tessera::proto {
namespace {

struct TypeName {
  std::string_view old_name, new_name;
  PlyScalar type;
  std::size_t size;
};

/// In the order of the enumeration.
constexpr std::array kTypes{
    TypeName{"char", "int8", PlyScalar::int8, 1},        TypeName{"uchar", "uint8", PlyScalar::uint8, 1},
    TypeName{"short", "int16", PlyScalar::int16, 2},     TypeName{"ushort", "uint16", PlyScalar::uint16, 2},
    TypeName{"int", "int32", PlyScalar::int32, 4},       TypeName{"uint", "uint32", PlyScalar::uint32, 4},
    TypeName{"float", "float32", PlyScalar::float32, 4}, TypeName{"double", "float64", PlyScalar::float64, 8},
};

/// Beyond these a header isn't one that anybody wrote; looking names up takes time in its square.
constexpr std::size_t kMostStatements = 1024;
constexpr std::size_t kLongestStatement = 1024;

class HeaderReader {
 public:
  HeaderReader(std::string_view bytes, std::string_view file_name) : bytes_(bytes), file_name_(file_name) {}

  PlyHeader read() {
    // A lone \r ends lines only where it ends the first one: a binary body may start with the byte of a \n.
    const std::size_t first_end = bytes_.find_first_of("\r\n");
    if (first_end != std::string_view::npos && !bytes_.substr(first_end).starts_with("\r\n")) {
      line_end_ = bytes_[first_end];
    }
    if (next_line() != "ply") fail("A PLY file starts with a line \"ply\"");
    for (std::string_view line = next_line(); line != "end_header"; line = next_line()) read_statement(line);
    if (!has_format_) fail("The header has no line \"format\"");
    header_.body = at_;
    header_.body_line = line_ + 1;
    return std::move(header_);
  }

 private:
  [[noreturn]] void fail(const std::string& detail) const {
    throw BrokenFile{{{file_place(file_name_, line_), detail}}};
  }

  /// A word of the file, which may be any file until it has said its format.
  std::string in_quotes(std::string_view word) const {
    return has_format_ ? '"' + std::string(word.substr(0, 40)) + '"' : "This";
  }

  /// Without its ending and the blanks before that.
  std::string_view next_line() {
    ++line_;
    const std::size_t end = bytes_.find(line_end_, at_);
    if (end == std::string_view::npos) fail("The header doesn't end: a line \"end_header\" is missing");
    std::string_view line = bytes_.substr(at_, end - at_);
    at_ = end + 1;
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ' || line.back() == '\t')) line.remove_suffix(1);
    return line;
  }

  void read_statement(std::string_view line) {
    TextCursor words(line, TextCursor::kNoComment);
    const std::string_view keyword = words.next();
    if (const std::string_view file = ply_texture_file(line); !file.empty() && header_.texture_files.size() < 2)
      header_.texture_files.emplace_back(file);
    if (keyword.empty() || keyword == "comment" || keyword == "obj_info") return;
    if (++statements_ > kMostStatements) fail("The header has too many statements");
    if (line.size() > kLongestStatement) fail("This statement is too long");
    if (keyword == "format") {
      read_format(words);
    } else if (keyword == "element") {
      read_element(words);
    } else if (keyword == "property") {
      read_property(words);
    } else {
      fail(in_quotes(keyword) +
           " is no statement of a PLY header: format, element, property, comment or end_header is expected");
    }
    if (!words.next().empty()) fail("This statement has a word too many");
  }

  void read_format(TextCursor& words) {
    const std::string_view encoding = words.next();
    if (encoding == "ascii") {
      header_.encoding = PlyEncoding::ascii;
    } else if (encoding == "binary_little_endian") {
      header_.encoding = PlyEncoding::little_endian;
    } else if (encoding == "binary_big_endian") {
      header_.encoding = PlyEncoding::big_endian;
    } else {
      fail("A format is ascii, binary_little_endian or binary_big_endian");
    }
    if (words.next() != "1.0") fail("The only version of the format is 1.0");
    if (std::exchange(has_format_, true)) fail("The format is given twice");
  }

  void read_element(TextCursor& words) {
    PlyElement element;
    element.name = words.next();
    element.line = line_;
    const std::optional<std::uint64_t> count = parse_integer<std::uint64_t>(words.next());
    if (element.name.empty() || !count) fail("An element has a name and a count");
    element.count = *count;
    for (const PlyElement& other : header_.elements) {
      if (other.name == element.name) fail(in_quotes(element.name) + " is the name of two elements");
    }
    header_.elements.push_back(std::move(element));
  }

  PlyScalar type(TextCursor& words) const {
    const std::string_view word = words.next();
    const auto* found = std::find_if(kTypes.begin(), kTypes.end(),
                                     [&](const TypeName& t) { return word == t.old_name || word == t.new_name; });
    if (found == kTypes.end()) fail(in_quotes(word) + " is no type of a PLY property");
    return found->type;
  }

  void read_property(TextCursor& words) {
    if (header_.elements.empty()) fail("A property needs an element before it");
    PlyProperty property;
    TextCursor peek = words;
    if (peek.next() == "list") {
      words = peek;
      property.count_type = type(words);
      if (*property.count_type >= PlyScalar::float32) fail("A list's length must be of an integer type");
    }
    property.type = type(words);
    property.name = words.next();
    if (property.name.empty()) fail("A property has a name");
    PlyElement& element = header_.elements.back();
    for (const PlyProperty& other : element.properties) {
      if (other.name == property.name) fail(in_quotes(property.name) + " is the name of two properties of its element");
    }
    element.properties.push_back(std::move(property));
  }

  std::string_view bytes_;
  std::string_view file_name_;
  char line_end_ = '\n';
  std::size_t at_ = 0;
  std::size_t line_ = 0;
  std::size_t statements_ = 0;
  bool has_format_ = false;
  PlyHeader header_;
};

}  // namespace

std::size_t size_of(PlyScalar type) { return kTypes[static_cast<std::size_t>(type)].size; }

PlyHeader read_ply_header(std::string_view bytes, std::string_view file_name) {
  return HeaderReader(bytes, file_name).read();
}

}  // namespace tessera::proto
