#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tessera::proto {

enum class PlyScalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

/// Bytes in a binary body.
std::size_t size_of(PlyScalar type);

struct PlyProperty {
  std::string name;
  PlyScalar type;                       ///< Of the value, or of a list's items.
  std::optional<PlyScalar> count_type;  ///< Of a list's length; nothing for a scalar.
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
  std::size_t line = 0;
};

enum class PlyEncoding { ascii, little_endian, big_endian };

/// What stands before the body of a PLY file (Turk, "The PLY Polygon File Format", 1994).
struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::ascii;
  std::vector<PlyElement> elements;        ///< With different names, each with properties of different names.
  std::vector<std::string> texture_files;  ///< That comments name, as MeshLab writes them.
  std::size_t body = 0;                    ///< Offset of the first byte after the header.
  std::size_t body_line = 1;
};

/// Reads the header; lines may end in \n, \r\n or \r. Throws `BrokenFile` with the line.
PlyHeader read_ply_header(std::string_view bytes, std::string_view file_name);

}  // namespace tessera::proto
