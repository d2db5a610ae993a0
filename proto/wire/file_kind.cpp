#include "proto/wire/file_kind.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <initializer_list>
#include <string>
#include <vector>

namespace tessera::proto {
namespace {

using namespace std::string_view_literals;

struct Description {
  FileKind kind;
  std::string_view text;
};

constexpr Description kDescriptions[] = {
    {FileKind::unknown, "a file of no kind that is known here"},
    {FileKind::json, "a JSON document"},
    {FileKind::obj, "an OBJ file"},
    {FileKind::mtl, "an MTL library"},
    {FileKind::ply, "a PLY file"},
    {FileKind::nff, "an NFF file"},
    {FileKind::gltf, "a glTF file"},
    {FileKind::glb, "a binary glTF file"},
    {FileKind::stl_ascii, "an STL file"},
    {FileKind::stl_binary, "a binary STL file"},
    {FileKind::fbx, "an FBX file"},
    {FileKind::blend, "a Blender file"},
    {FileKind::three_ds, "a 3DS file"},
    {FileKind::alembic, "an Alembic file"},
    {FileKind::usd, "a USD file"},
    {FileKind::vrml, "a VRML file"},
    {FileKind::off, "an OFF file"},
    {FileKind::vtk, "a VTK file"},
    {FileKind::collada, "a COLLADA file"},
    {FileKind::xml, "an XML document"},
    {FileKind::html, "an HTML page"},
    {FileKind::png, "a PNG image"},
    {FileKind::jpeg, "a JPEG image"},
    {FileKind::gif, "a GIF image"},
    {FileKind::tiff, "a TIFF image"},
    {FileKind::webp, "a WebP image"},
    {FileKind::exr, "an OpenEXR image"},
    {FileKind::hdr, "a Radiance image"},
    {FileKind::pdf, "a PDF document"},
    {FileKind::zip, "a ZIP archive"},
    {FileKind::gzip, "a gzip archive"},
    {FileKind::bzip2, "a bzip2 archive"},
    {FileKind::xz, "an xz archive"},
    {FileKind::zstandard, "a Zstandard archive"},
    {FileKind::seven_zip, "a 7z archive"},
    {FileKind::tar, "a tar archive"},
    {FileKind::program, "a program"},
};

struct Signature {
  FileKind kind;
  std::size_t offset;
  std::string_view bytes;
};

constexpr Signature kSignatures[] = {
    {FileKind::glb, 0, "glTF"sv},
    {FileKind::fbx, 0, "Kaydara FBX Binary"sv},
    {FileKind::fbx, 0, "; FBX"sv},
    {FileKind::blend, 0, "BLENDER"sv},
    {FileKind::alembic, 0, "Ogawa"sv},
    {FileKind::usd, 0, "PXR-USDC"sv},
    {FileKind::usd, 0, "#usda"sv},
    {FileKind::vrml, 0, "#VRML"sv},
    {FileKind::vrml, 0, "#X3D"sv},
    {FileKind::vtk, 0, "# vtk DataFile"sv},
    {FileKind::png, 0, "\x89PNG\r\n\x1A\n"sv},
    {FileKind::jpeg, 0, "\xFF\xD8\xFF"sv},
    {FileKind::gif, 0, "GIF8"sv},
    {FileKind::tiff, 0, "II*\0"sv},
    {FileKind::tiff, 0, "MM\0*"sv},
    {FileKind::webp, 8, "WEBP"sv},
    {FileKind::exr, 0, "\x76\x2F\x31\x01"sv},
    {FileKind::hdr, 0, "#?RADIANCE"sv},
    {FileKind::hdr, 0, "#?RGBE"sv},
    {FileKind::pdf, 0, "%PDF-"sv},
    {FileKind::zip, 0, "PK\x03\x04"sv},
    {FileKind::zip, 0, "PK\x05\x06"sv},
    {FileKind::gzip, 0, "\x1F\x8B"sv},
    {FileKind::bzip2, 0, "BZh"sv},
    {FileKind::xz, 0, "\xFD\x37zXZ\0"sv},
    {FileKind::zstandard, 0, "\x28\xB5\x2F\xFD"sv},
    {FileKind::seven_zip, 0, "7z\xBC\xAF\x27\x1C"sv},
    {FileKind::tar, 257, "ustar"sv},
    {FileKind::program, 0,
     "\x7F"
     "ELF"sv},
};

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

std::uint32_t little_endian(std::string_view four_bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(four_bytes[i]);
  return value;
}

/// A header of 80 bytes, the number of triangles, 50 bytes for each of them. Some writers add a little.
bool is_binary_stl(std::string_view head, std::uintmax_t size) {
  constexpr std::uintmax_t kHeader = 84, kTriangle = 50;
  if (head.size() < kHeader) return false;
  const std::uintmax_t triangles = little_endian(head.substr(80, 4));
  return triangles > 0 && size == kHeader + kTriangle * triangles;
}

bool is_three_ds(std::string_view head, std::uintmax_t size) {
  return head.size() >= 6 && head.starts_with("MM"sv) && little_endian(head.substr(2, 4)) == size;
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

/// Of text that starts with '<'.
FileKind kind_of_markup(std::string_view text) {
  const std::string start = lower_case(text.substr(0, 1024));
  if (start.find("<collada") != start.npos) return FileKind::collada;
  if (start.find("<html") != start.npos || start.find("<!doctype html") != start.npos) return FileKind::html;
  return FileKind::xml;
}

/// Whether JSON text has what only glTF has at its top: "asset" with a "version", or what holds meshes together. A walk
/// over strings and braces, so that the text may be cut off anywhere and nest as deep as it likes.
bool is_gltf(std::string_view text) {
  std::size_t depth = 0;
  bool in_asset = false;
  std::string_view word;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (c == '{' || c == '[') {
      ++depth;
    } else if (c == '}' || c == ']') {
      if (depth > 0) --depth;
      if (depth == 1) in_asset = false;
    } else if (c == '"') {
      const std::size_t begin = ++at;
      while (at < text.size() && text[at] != '"') at += text[at] == '\\' ? 2 : 1;
      if (at >= text.size()) return false;
      word = text.substr(begin, at - begin);
    } else if (c == ':') {
      if (depth == 1 && (word == "accessors" || word == "bufferViews")) return true;
      if (depth == 1) in_asset = word == "asset";
      if (depth == 2 && in_asset && word == "version") return true;
    }
  }
  return false;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    while (!line.empty() && is_blank(line.front())) line.remove_prefix(1);
    if (line.empty()) return words;
    const auto end = std::ranges::find_if(line, is_blank);
    words.push_back(line.substr(0, static_cast<std::size_t>(end - line.begin())));
    line.remove_prefix(words.back().size());
  }
}

bool is_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error != std::errc::invalid_argument && end == word.data() + word.size();
}

bool is_one_of(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::ranges::find(words, word) != words.end();
}

/// What a line of text says: a kind, `unknown` when more than one may have it, or that none has.
struct Verdict {
  FileKind kind = FileKind::unknown;
  bool ends_search = true;
};
constexpr Verdict kUndecided{FileKind::unknown, false};
constexpr Verdict kNone{FileKind::unknown, true};

/// OBJ: Wavefront, "Advanced Visualizer Manual", appendix B. NFF: Haines, "A Proposal for Standard Graphics
/// Environments", 1987. They share v, f, s, l, p and c, and differ in what follows.
Verdict verdict_on(std::string_view line) {
  const auto words = words_of(line);
  if (words.empty() || words[0].starts_with('#')) return kUndecided;
  const std::string keyword = lower_case(words[0]);
  const std::size_t values = words.size() - 1;
  const bool are_numbers = std::all_of(words.begin() + 1, words.end(), is_number);

  if (is_one_of(keyword, {"vn", "vt", "vp", "o", "g", "usemtl", "mtllib", "usemap", "maplib", "cstype", "mg"}))
    return {FileKind::obj};
  if (keyword == "newmtl") return {FileKind::mtl};
  if (keyword == "v") return values == 0 ? Verdict{FileKind::nff} : are_numbers ? Verdict{FileKind::obj} : kNone;
  if (is_one_of(keyword, {"from", "at", "up", "angle", "hither", "resolution", "b"}))
    return are_numbers && values > 0 ? Verdict{FileKind::nff} : kNone;
  if (keyword == "f") {
    if (values == 8 && are_numbers) return {FileKind::nff};
    if (values >= 3 && (!are_numbers || values < 8) && words[1].find_first_not_of("0123456789-/") == line.npos)
      return {FileKind::obj};
    return kUndecided;
  }
  if (keyword == "off" && values == 0) return {FileKind::off};
  return is_one_of(keyword, {"s", "l", "p", "pp", "c"}) ? kUndecided : kNone;
}

/// Of text that none of the others is. A last line that is cut off isn't looked at.
FileKind kind_of_statements(std::string_view text, bool is_whole) {
  while (!text.empty()) {
    const std::size_t end = text.find_first_of("\r\n");
    if (end == text.npos && !is_whole) break;
    const Verdict verdict = verdict_on(text.substr(0, end));
    if (verdict.ends_search) return verdict.kind;
    text.remove_prefix(end == text.npos ? text.size() : end + 1);
  }
  return FileKind::unknown;
}

}  // namespace

std::string_view description(FileKind kind) { return std::ranges::find(kDescriptions, kind, &Description::kind)->text; }

FileKind file_kind(std::string_view head, std::uintmax_t size) {
  if (is_three_ds(head, size)) return FileKind::three_ds;
  for (const Signature& signature : kSignatures)
    if (head.substr(std::min(signature.offset, head.size())).starts_with(signature.bytes)) return signature.kind;
  if (is_binary_stl(head, size)) return FileKind::stl_binary;

  std::string_view text = head;
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  if (text.starts_with("ply") && (text.size() == 3 || is_blank(text[3]))) return FileKind::ply;
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  if (text.starts_with('{')) return is_gltf(text) ? FileKind::gltf : FileKind::json;
  if (text.starts_with('[')) return FileKind::json;
  if (text.starts_with('<')) return kind_of_markup(text);
  if (text.starts_with("solid") && (text.find("facet") != text.npos || text.find("endsolid") != text.npos))
    return FileKind::stl_ascii;
  if (text.find('\0') != text.npos) return FileKind::unknown;
  return kind_of_statements(text, head.size() == size);
}

FileKind file_kind(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!file || error) return FileKind::unknown;
  std::string head(std::min<std::uintmax_t>(size, kFileHead), '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  return file_kind(head, size);
}

}  // namespace tessera::proto
