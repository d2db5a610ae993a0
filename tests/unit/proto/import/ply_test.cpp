#include "proto/import/ply.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <stop_token>
#include <tuple>

#include <gtest/gtest.h>

#include "proto/import/broken_file.h"
#include "proto/import/polygon.h"
#include "tests/support/png_bytes.h"
#include "tests/support/temporary_folder.h"

namespace tessera::proto {
namespace {

Imported read(std::string_view bytes) { return import_ply(bytes, "a.ply"); }

std::vector<std::string> errors_of(std::string_view bytes) {
  std::vector<std::string> errors;
  try {
    read(bytes);
  } catch (const BrokenFile& broken) {
    for (const FieldError& error : broken.errors) errors.push_back(error.pointer + ": " + error.detail);
  }
  return errors;
}
std::string error_of(std::string_view bytes) {
  const std::vector<std::string> errors = errors_of(bytes);
  return errors.size() == 1 ? errors[0] : std::to_string(errors.size()) + " errors";
}

const TriangleMesh& mesh(const Imported& file) { return std::get<TriangleMesh>(file.parts.at(0).shape); }

using Triangles = std::vector<TriangleIndices>;

const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";
const std::string kTriangleHeader = "ply\nformat ascii 1.0\nelement vertex 3\n" + kXyz +
                                    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
const std::string kSquare = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

std::string square_header(const std::string& faces) {
  return "ply\nformat ascii 1.0\nelement vertex 4\n" + kXyz + faces + "end_header\n";
}

/// The bytes of a number in the asked-for order.
template <typename T>
std::string raw(T value, bool big) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (big) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

TEST(Ply, AsciiWithPolygonsOfAnySize) {
  const Imported file = read(square_header("element face 3\nproperty list uchar int vertex_index\n") + kSquare +
                             "3 0 1 2\n4 0 1 2 3\n2 0 1\n");
  EXPECT_EQ(mesh(file).positions[2], (Vec3{1, 1, 0}));
  EXPECT_EQ(mesh(file).triangles, (Triangles{{0, 1, 2}, {0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(file.parts[0].material, std::nullopt);
  EXPECT_TRUE(mesh(file).normals.empty());
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_EQ(file.warnings[0].pointer, "a.ply:16");
}

TEST(Ply, NumbersMayStandOnAnyLine) {
  EXPECT_EQ(mesh(read(kTriangleHeader + "0 0 0 1 0\n0 1\n\n 1 .5e0 \t3 0 1 2")).positions[2], (Vec3{1, 1, 0.5F}));
}

TEST(Ply, LinesMayEndAsOnAnySystem) {
  std::string text = kTriangleHeader + "0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n";
  std::string windows, mac = text;
  for (const char c : text) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  std::replace(mac.begin(), mac.end(), '\n', '\r');
  EXPECT_EQ(mesh(read(windows)).triangles, (Triangles{{0, 1, 2}}));
  EXPECT_EQ(mesh(read(mac)).triangles, (Triangles{{0, 1, 2}}));
}

TEST(Ply, ABinaryBodyMayStartWithTheByteOfANewline) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string header =
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty uchar x\nproperty uchar "
        "y\nproperty uchar z\nelement face 1\nproperty list uchar uchar vertex_indices\nend_header\n";
    std::string bytes;
    for (const char c : header) bytes += c == '\n' ? end : std::string(1, c);
    bytes += std::string("\n\n\n\0\n\n\1\0\n\3\0\1\2", 13);
    EXPECT_EQ(mesh(read(bytes)).positions, (std::vector<Vec3>{{10, 10, 10}, {0, 10, 10}, {1, 0, 10}}));
  }
}

/// Every type, in both orders and with both names, in an element with a list that is skipped.
template <typename T>
void expect_type(const std::string& name) {
  for (const bool big : {false, true}) {
    SCOPED_TRACE(name + (big ? " big" : " little"));
    std::string bytes = "ply\nformat binary_" + std::string(big ? "big" : "little") + "_endian 1.0\nelement vertex 3\n";
    for (const char* axis : {"x", "y", "z"}) bytes += "property " + name + ' ' + axis + '\n';
    bytes += "property list ushort " + name + " extra\nelement face 1\nproperty list uint uchar vertex_indices\n";
    bytes += "end_header\n";
    for (const int x : {1, 100, 7}) {
      bytes += raw(static_cast<T>(x), big) + raw(static_cast<T>(x / 7), big) + raw(static_cast<T>(3), big);
      bytes += raw(std::uint16_t{2}, big) + raw(T{1}, big) + raw(T{2}, big);
    }
    bytes += raw(std::uint32_t{3}, big) + std::string("\0\1\2", 3);
    const Imported file = read(bytes);
    EXPECT_EQ(mesh(file).positions, (std::vector<Vec3>{{1, 0, 3}, {100, 14, 3}, {7, 1, 3}}));
    EXPECT_EQ(mesh(file).triangles, (Triangles{{0, 1, 2}}));
  }
}

TEST(Ply, EveryTypeInBothByteOrders) {
  for (const char* name : {"char", "int8"}) expect_type<std::int8_t>(name);
  for (const char* name : {"uchar", "uint8"}) expect_type<std::uint8_t>(name);
  for (const char* name : {"short", "int16"}) expect_type<std::int16_t>(name);
  for (const char* name : {"ushort", "uint16"}) expect_type<std::uint16_t>(name);
  for (const char* name : {"int", "int32"}) expect_type<std::int32_t>(name);
  for (const char* name : {"uint", "uint32"}) expect_type<std::uint32_t>(name);
  for (const char* name : {"float", "float32"}) expect_type<float>(name);
  for (const char* name : {"double", "float64"}) expect_type<double>(name);
}

TEST(Ply, IndicesOfEveryIntegerType) {
  const auto triangle = [](const std::string& type, const std::string& face) {
    return read(
        "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty char x\nproperty char y\nproperty char "
        "z\nelement face 1\nproperty list char " +
        type + " vertex_indices\nend_header\n" + std::string("\0\0\0\1\0\0\0\1\0\3", 10) + face);
  };
  EXPECT_EQ(mesh(triangle("char", std::string("\2\1\0", 3))).triangles, (Triangles{{2, 1, 0}}));
  EXPECT_EQ(mesh(triangle("ushort", std::string("\0\2\0\1\0\0", 6))).triangles, (Triangles{{2, 1, 0}}));
  EXPECT_EQ(mesh(triangle("uint", std::string("\0\0\0\2\0\0\0\1\0\0\0\0", 12))).triangles, (Triangles{{2, 1, 0}}));
}

TEST(Ply, NormalsWhereAllThreeAreThere) {
  const std::string rest = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string start = "ply\nformat ascii 1.0\ncomment nx before x\nelement vertex 3\nproperty float nx\n";
  const Imported with = read(start + "property double ny\nproperty float nz\n" + kXyz + rest +
                             "0 1 2 0 0 0\n0 1 2 1 0 0\n0 0 0 1 1 0\n3 0 1 2");
  ASSERT_EQ(mesh(with).normals.size(), 3U);
  EXPECT_EQ(mesh(with).normals[1], (Vec3{0, 1, 2}));
  EXPECT_EQ(mesh(with).normals[2], (Vec3{0, 0, 1})) << "a normal without direction is the face's";
  EXPECT_EQ(mesh(with).positions[1], (Vec3{1, 0, 0}));

  const Imported without = read(start + kXyz + rest + "0 0 0 0\n0 1 0 0\n0 1 1 0\n3 0 1 2");
  EXPECT_TRUE(mesh(without).normals.empty());
  ASSERT_EQ(without.warnings.size(), 1U);
  EXPECT_NE(without.warnings[0].detail.find("nx"), std::string::npos);
}

TEST(Ply, UnknownElementsAndPropertiesAreSkippedAndNamed) {
  const Imported file = read(
      "ply\nformat ascii 1.0\nobj_info by hand\nelement before 2\nproperty list char float numbers\nproperty int i\n"
      "element empty 99999999999999999\nelement vertex 3\n" +
      kXyz +
      "property uchar red\nelement face 1\nproperty list uchar float texcoord\nproperty list uchar int "
      "vertex_indices\nproperty int flags\nelement edge 1\nproperty int vertex1\nend_header\n"
      "2 1.5 nan 3\n0 4\n0 0 0 255\n1 0 0 255\n0 1 0 255\n1 0.5 3 0 1 2 7\n5\n");
  EXPECT_EQ(mesh(file).triangles, (Triangles{{0, 1, 2}}));
  ASSERT_EQ(file.warnings.size(), 5U);
  EXPECT_EQ(file.warnings[0].pointer, "a.ply:4");
  EXPECT_NE(file.warnings[2].detail.find("red"), std::string::npos);
  EXPECT_NE(file.warnings[3].detail.find("texcoord flags"), std::string::npos);
  EXPECT_NE(file.warnings[4].detail.find("edge"), std::string::npos);
}

TEST(Ply, TristripsTurnEveryOtherTriangleAndRestart) {
  const Imported file = read("ply\nformat ascii 1.0\nelement vertex 6\n" + kXyz +
                             "element tristrips 2\nproperty list int int vertex_indices\nend_header\n"
                             "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n"
                             "10 0 1 2 3 4 -1 3 5 4 -1\n5 0 1 1 2 3\n");
  EXPECT_EQ(mesh(file).triangles, (Triangles{{0, 1, 2}, {2, 1, 3}, {2, 3, 4}, {3, 5, 4}, {1, 2, 3}}));
  EXPECT_TRUE(file.warnings.empty());
}

TEST(Ply, FacesMayStandBeforeTheirVertices) {
  const Imported file = read(
      "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement "
      "vertex 4\n" +
      kXyz + "end_header\n4 0 1 2 3\n" + kSquare);
  EXPECT_EQ(mesh(file).triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
}

TEST(Ply, ConcaveFacesAreTiled) {
  const Imported file = read(square_header("element face 1\nproperty list uchar int vertex_indices\n") +
                             "0 0 0\n2 -2 0\n0 4 0\n-2 -2 0\n4 1 2 3 0");
  double area = 0;
  for (const TriangleIndices& t : mesh(file).triangles) area += std::abs(area_vector(mesh(file).positions, t).z);
  EXPECT_DOUBLE_EQ(area, 16);
}

TEST(Ply, WithoutTrianglesThereIsNoPartButAWarning) {
  for (const char* faces : {"", "element face 0\nproperty list uchar int vertex_indices\n"}) {
    const Imported file = read(square_header(faces) + kSquare);
    EXPECT_TRUE(file.parts.empty());
    ASSERT_EQ(file.warnings.size(), 1U);
    EXPECT_EQ(file.warnings[0].detail, "The file has no triangles");
  }
}

TEST(Ply, UnusableTrianglesAreDroppedAndCounted) {
  const Imported file = read("ply\nformat ascii 1.0\nelement vertex 5\n" + kXyz +
                             "element face 5\nproperty list uchar int vertex_indices\nend_header\n"
                             "0 0 0\n1 0 nan\n1 1 0\n0 1e40 0\n1 0 0\n3 0 1 2\n3 0 2 2\n4 0 1 2 3\n3 0 2 3\n3 0 4 2\n");
  EXPECT_EQ(mesh(file).triangles.size(), 1U);
  ASSERT_EQ(file.warnings.size(), 2U);
  EXPECT_NE(file.warnings[0].detail.find("(4 times)"), std::string::npos) << file.warnings[0].detail;
  EXPECT_NE(file.warnings[1].detail.find("two corners in one place"), std::string::npos);
}

TEST(Ply, UnusableTrianglesOfAStripAreDroppedAndCounted) {
  const Imported file = read("ply\nformat ascii 1.0\nelement vertex 5\n" + kXyz +
                             "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
                             "0 0 0\n1 0 0\n0 1 0\n1 1 0\nnan 2 0\n5 0 1 2 3 4\n");
  EXPECT_EQ(mesh(file).triangles.size(), 2U);
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_NE(file.warnings[0].detail.find("NaN"), std::string::npos);
}

TEST(Ply, ADoubleBeyondFloatIsNotFinite) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty double "
      "y\nproperty double z\nelement face 1\nproperty list uchar uchar vertex_indices\nend_header\n";
  for (const double v : {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1e300, 0.0}) bytes += raw(v, false);
  bytes += std::string("\3\0\1\2", 4);
  EXPECT_NE(errors_of(bytes).at(0).find("NaN, infinite or beyond"), std::string::npos);
}

TEST(Ply, FacesThatNameNoVertexAreDroppedAndCounted) {
  const std::string header = square_header("element face 4\nproperty list uchar int vertex_indices\n") + kSquare;
  const Imported file = read(header + "3 0 1 4\n3 0 1 2\n3 -1 1 2\n4 0 1 9 9\n");
  EXPECT_EQ(mesh(file).triangles, (Triangles{{0, 1, 2}}));
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_EQ(file.warnings[0].pointer, "a.ply:14");
  EXPECT_EQ(file.warnings[0].detail, "A face that names a vertex that isn't there was dropped (3 times)");

  const std::vector<std::string> errors = errors_of(header + "3 0 1 4\n2 0 1\n3 -1 1 2\n0\n");
  ASSERT_EQ(errors.size(), 2U) << "nothing is left";
  EXPECT_EQ(errors[0], "a.ply:14: face 0 names vertex 4, but the file has 4, counted from 0");
  EXPECT_TRUE(errors[1].starts_with("a.ply:16: face 2 names vertex -1")) << errors[1];

  std::string many = square_header("element face 1\nproperty list int int vertex_indices\n") + kSquare + "100";
  for (int i = 0; i < 100; ++i) many += " 9";
  EXPECT_EQ(errors_of(many).size(), kMaxFieldErrors);
}

TEST(Ply, OfAStripOnlyTheTrianglesThatNameNoVertexAreDropped) {
  const Imported file = read("ply\nformat ascii 1.0\nelement vertex 6\n" + kXyz +
                             "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
                             "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n8 0 1 2 7 3 2 4 5\n");
  EXPECT_EQ(mesh(file).triangles, (Triangles{{0, 1, 2}, {3, 2, 4}, {4, 2, 5}}));
  EXPECT_EQ(file.warnings.size(), 1U);
}

TEST(Ply, NothingIsQuotedOfAFileThatMayBeAnything) {
  for (const char* text : {"hunter2\n", "ply\nhunter2\n", "ply\nelement hunter2 x\n",
                           "ply\nelement hunter2 1\nelement "
                           "hunter2 1\n",
                           "ply\nelement a 1\nproperty hunter2 x\n", "ply\nformat hunter2\n"}) {
    EXPECT_EQ(error_of(text).find("hunter2"), std::string::npos) << error_of(text);
  }
  EXPECT_NE(error_of("ply\nformat ascii 1.0\nvertexes 3\n").find("\"vertexes\""), std::string::npos) << "a PLY file";
}

TEST(Ply, StopsWhenNobodyWantsIt) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(import_ply(kTriangleHeader + "0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n", "a.ply", nullptr, stop.get_token()),
               Abandoned);
}

TEST(Ply, ATruncatedBinaryFileNamesTheMissingBytes) {
  const std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\n" + kXyz +
                             "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
  std::string bytes = header;
  for (const float v : {0, 0, 0, 1, 0, 0, 0, 1, 0}) bytes += raw(v, false);
  for (int face = 0; face < 2; ++face) {
    bytes += '\3';
    for (const int i : {0, 1, 2}) bytes += raw(i, false);
  }
  ASSERT_EQ(mesh(read(bytes)).triangles.size(), 2U);
  EXPECT_EQ(error_of(bytes.substr(0, bytes.size() - 1)), "a.ply: The file is cut off: at least 1 byte is missing");
  EXPECT_EQ(error_of(bytes.substr(0, bytes.size() - 5)), "a.ply: The file is cut off: at least 5 bytes are missing");
  EXPECT_EQ(error_of(bytes.substr(0, bytes.size() - 14)), "a.ply: The file is cut off: at least 2 bytes are missing");
  EXPECT_EQ(error_of(bytes.substr(0, header.size() + 30)), "a.ply: The file is cut off: at least 8 bytes are missing");
  for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_NE(error_of(bytes.substr(0, size)), "0 errors");
}

TEST(Ply, ATruncatedAsciiFileNamesItsLastLine) {
  const std::string text = kTriangleHeader + "0 0 0\n1 0 0\n1 1 0\n3 0 1";
  EXPECT_EQ(error_of(text), "a.ply:13: The file ends where a number is expected");
}

TEST(Ply, CountsBeyondTheFileAreRefusedBeforeAnythingIsAllocated) {
  const auto with_counts = [](const std::string& vertices, const std::string& faces) {
    return error_of("ply\nformat binary_little_endian 1.0\nelement vertex " + vertices + '\n' + kXyz + "element face " +
                    faces + "\nproperty list int int vertex_indices\nend_header\n");
  };
  EXPECT_EQ(with_counts("4000000000", "0"), "a.ply: The file is cut off: at least 48000000000 bytes are missing");
  EXPECT_EQ(with_counts("18446744073709551615", "1"), "a.ply:3: The count of \"vertex\" is beyond any file");
  EXPECT_EQ(with_counts("0", "1000000000000"), "a.ply: The file is cut off: at least 4000000000000 bytes are missing");
  EXPECT_NE(with_counts("18446744073709551616", "1"), "0 errors");
  EXPECT_NE(with_counts("-1", "1"), "0 errors");

  const std::string list = "ply\nformat binary_little_endian 1.0\nelement vertex 0\n" + kXyz +
                           "element face 1\nproperty list int int vertex_indices\nend_header\n";
  EXPECT_EQ(error_of(list + raw(-5, false)), "a.ply: face 0 has a list of length -5");
  EXPECT_NE(error_of(list + raw(2'000'000'000, false)), "0 errors");
}

TEST(Ply, HeadersThatAreNone) {
  const auto expect_error = [](const std::string& text, const std::string& error) {
    EXPECT_EQ(error_of(text).substr(0, error.size()), error) << text;
  };
  const std::string start = "ply\nformat ascii 1.0\n";
  expect_error("", "a.ply:1: The header doesn't end");
  expect_error("plyy\n", "a.ply:1: A PLY file starts with");
  expect_error(start + "element vertex 1\n", "a.ply:4: The header doesn't end");
  expect_error("ply\nend_header\n", "a.ply:2: The header has no line \"format\"");
  expect_error("ply\nformat ascii 2.0\nend_header\n", "a.ply:2:");
  expect_error("ply\nformat binary 1.0\nend_header\n", "a.ply:2:");
  expect_error(start + "format ascii 1.0\nend_header\n", "a.ply:3:");
  expect_error(start + "end_header\n", "a.ply: The file has no element \"vertex\"");
  expect_error(start + "property int x\nend_header\n", "a.ply:3:");
  expect_error(start + "elements vertex 3\nend_header\n", "a.ply:3:");
  expect_error(start + "element vertex three\nend_header\n", "a.ply:3:");
  expect_error(start + "element vertex\nend_header\n", "a.ply:3:");
  expect_error(start + "element vertex 3\nproperty flaot x\nend_header\n", "a.ply:4: \"flaot\" is no type");
  expect_error(start + "element vertex 3\nproperty float\nend_header\n", "a.ply:4:");
  expect_error(start + "element vertex 3\nproperty float x y\nend_header\n", "a.ply:4:");
  expect_error(start + "element vertex 3\nproperty float x\nproperty int x\nend_header\n", "a.ply:5:");
  expect_error(start + "element vertex 3\nelement vertex 3\nend_header\n", "a.ply:4:");
  expect_error(start + "element vertex 3\nproperty list float int x\nend_header\n", "a.ply:4:");
  expect_error(start + "element vertex 3\nproperty float x\nend_header\n", "a.ply:3: The element \"vertex\" needs");
  const std::string vertex = start + "element vertex 0\n" + kXyz;
  expect_error(vertex + "element face 1\nproperty int vertex_indices\nend_header\n", "a.ply:7:");
  expect_error(vertex + "element face 1\nproperty list int float vertex_indices\nend_header\n", "a.ply:7:");
  expect_error(vertex + "element face 1\nproperty list int int indices\nend_header\n", "a.ply:7:");
}

TEST(Ply, AsciiNumbersThatAreNone) {
  EXPECT_EQ(error_of(kTriangleHeader + "0 0 0\n1 0x1 0\n1 1 0\n3 0 1 2\n"),
            "a.ply:11: A number is expected here, not \"0x1\"");
  EXPECT_EQ(error_of(kTriangleHeader + "0 0 0\n1 0 0\n1 1 0\n3 0 1.5 2\n"),
            "a.ply:13: A whole number is expected here, not \"1.5\"");
}

TEST(Ply, WhatFollowsTheLastElementIsNamed) {
  const std::string text = kTriangleHeader + "0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n";
  EXPECT_TRUE(read(text + " \r\n\n").warnings.empty());
  EXPECT_EQ(read(text + "4").warnings.size(), 1U);
}

std::string colored(const std::string& properties, const std::string& rows, const std::string& comment = "") {
  return "ply\nformat ascii 1.0\n" + comment + "element vertex 3\n" + kXyz + properties +
         "element face 1\nproperty list uchar int vertex_indices\nend_header\n" + rows + "3 0 1 2\n";
}
const std::string kBytes = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
const std::string kFloats = "property float red\nproperty float green\nproperty float blue\n";

/// sRGB (IEC 61966-2-1).
double light(double encoded) { return std::pow((encoded + 0.055) / 1.055, 2.4); }

TEST(Ply, ColoursOfVertices) {
  const Imported file = read(colored(kBytes, "0 0 0 255 51 0\n1 0 0 255 255 255\n1 1 0 0 0 102\n"));
  EXPECT_TRUE(file.warnings.empty());
  const auto& colors = mesh(file).attributes->colors;
  ASSERT_EQ(colors.size(), 3U);
  EXPECT_EQ(colors[0][0], 1);
  EXPECT_NEAR(colors[0][1], light(0.2), 1e-6);
  EXPECT_EQ(colors[1], (std::array<float, 4>{1, 1, 1, 1}));
  EXPECT_NEAR(colors[2][2], light(0.4), 1e-6);
  const Material& material = file.materials.at(file.parts.at(0).material.value());
  EXPECT_EQ(std::get<Diffuse>(material.surface).color, (Rgb{1, 1, 1}));
  EXPECT_TRUE(material.has_vertex_colors);
  EXPECT_FALSE(material.has_vertex_alpha);
}

TEST(Ply, ColoursInEveryForm) {
  const std::string shorts =
      "property ushort diffuse_red\nproperty ushort diffuse_green\nproperty ushort diffuse_blue\n";
  for (const auto& [properties, fifth, most] :
       {std::tuple(kFloats, "0.2", "1"), std::tuple(kFloats, "51", "255"), std::tuple(kBytes, "51", "255"),
        std::tuple(shorts, "13107", "65535")}) {
    const std::string row = std::string(" ") + fifth + " " + most + " 0\n";
    const Imported file = read(colored(properties, "0 0 0" + row + "1 0 0" + row + "1 1 0" + row));
    EXPECT_TRUE(file.warnings.empty());
    EXPECT_NEAR(mesh(file).attributes->colors.at(2)[0], light(0.2), 1e-6) << fifth;
    EXPECT_EQ(mesh(file).attributes->colors.at(2)[1], 1) << fifth;
    EXPECT_EQ(mesh(file).attributes->colors.at(2)[2], 0) << fifth;
  }
  // One number says for all what the largest is.
  const Imported red = read(colored(kFloats, "0 0 0 255 1 1\n1 0 0 255 1 1\n1 1 0 255 1 1\n"));
  EXPECT_EQ(mesh(red).attributes->colors.at(0)[0], 1);
  EXPECT_NEAR(mesh(red).attributes->colors.at(0)[1], 1 / 255.0 / 12.92, 1e-6);  // sRGB's straight part
  const Imported odd = read(colored(kFloats, "0 0 0 nan -1 0\n1 0 0 1 1 1\n1 1 0 inf 0 0\n"));
  EXPECT_EQ(mesh(odd).attributes->colors.at(0), (std::array<float, 4>{0, 0, 0, 1}));
  const Imported half =
      read(colored("property uchar red\nproperty uchar green\n", "0 0 0 1 1\n1 0 0 1 1\n1 1 0 1 1\n"));
  EXPECT_EQ(mesh(half).attributes, nullptr);
  EXPECT_EQ(half.parts[0].material, std::nullopt);
  EXPECT_TRUE(half.warnings.at(0).detail.ends_with(": red green"));
}

TEST(Ply, AlphaOfVertices) {
  const std::string alpha = kBytes + "property uchar alpha\n";
  const Imported file = read(colored(alpha, "0 0 0 0 0 0 255\n1 0 0 0 0 0 51\n1 1 0 0 0 0 0\n"));
  EXPECT_TRUE(file.materials.at(0).has_vertex_alpha);
  EXPECT_NEAR(mesh(file).attributes->colors.at(1)[3], 0.2, 1e-6) << "no curve";
  EXPECT_FALSE(
      read(colored(alpha, "0 0 0 0 0 0 255\n1 0 0 0 0 0 255\n1 1 0 0 0 0 255\n")).materials.at(0).has_vertex_alpha);
  const Imported none = read(colored(alpha, "0 0 0 0 0 0 0\n1 0 0 0 0 0 0\n1 1 0 0 0 0 0\n"));
  EXPECT_FALSE(none.materials.at(0).has_vertex_alpha);
  EXPECT_EQ(mesh(none).attributes->colors.at(1)[3], 1);
  EXPECT_EQ(none.warnings.at(0).detail, "An alpha that is 0 everywhere is taken for none");
}

TEST(Ply, TheTextureThatACommentNames) {
  const TemporaryFolder folder;
  folder.write("a b.png", png_bytes(3, {255, 0, 0}));
  folder.write("bad.png", "no image");
  const auto read_with = [&](const std::string& properties, const std::string& comment) {
    const std::string rows = "0 0 0 0 0.25\n1 0 0 1 1\n1 1 0 nan 1\n";
    return import_ply(colored(properties, rows, comment), "a.ply", [&](std::string_view name) {
      const std::filesystem::path path = folder.path() / name;
      return std::filesystem::is_regular_file(path) ? std::optional(path) : std::nullopt;
    });
  };
  for (const char* names : {"s t", "u v", "texture_u texture_v"}) {
    const std::string u(names, std::strchr(names, ' ')), v = std::strchr(names, ' ') + 1;
    const std::string properties = "property float " + u + "\nproperty float " + v + "\n";
    const Imported file = read_with(properties, "comment TextureFile textures\\a b.png\n");
    ASSERT_EQ(file.warnings.size(), 1U) << names;
    EXPECT_EQ(file.warnings[0].detail, "A texture coordinate that isn't finite counts as 0 0");
    EXPECT_EQ(mesh(file).attributes->uvs[0], (std::vector<Vec2>{{0, 0.75F}, {1, 0}, {0, 1}})) << names;
    EXPECT_EQ(file.materials.at(0).textures.at(0).slot, TextureSlot::base_color);
    EXPECT_TRUE(file.textures.at(0).is_srgb);
  }
  const std::string st = "property float s\nproperty float t\n";
  const std::pair<const char*, std::string> comments[] = {
      {"comment TextureFile gone.png\n", "The texture \"gone.png\" isn't there"},
      {"comment TextureFile bad.png\n",
       "The texture \"bad.png\" can't be used: It is no image of a kind that is known here "
       "(PNG, JPEG, WebP, EXR, HDR, TIFF, BMP, Targa)"},
      {"comment TextureFile \n", "Of the element \"vertex\" is ignored: s t"}};
  for (const auto& [comment, words] : comments) {
    const Imported file = read_with(st, comment);
    EXPECT_TRUE(file.textures.empty());
    EXPECT_EQ(file.parts.at(0).material, std::nullopt);
    EXPECT_EQ(file.warnings.at(0).detail, words);
  }
  const Imported without = read_with("property float p\nproperty float q\n", "comment TextureFile a b.png\n");
  EXPECT_EQ(without.warnings.at(0).detail, "The file names a texture, but has no texture coordinates");

  // As MeshLab writes them: of each face's corners.
  const std::string square =
      "ply\nformat ascii 1.0\ncomment TextureFile a b.png\nelement vertex 4\n" + kXyz +
      "element face 4\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n"
      "property int texnumber\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
      "3 0 1 2 6 0 0 1 0 1 1 0\n3 0 2 3 6 0 0 0.5 1 0 1 0\n3 0 1 9 6 0 0 1 0 1 1 0\n"
      "3 0 1 3 2 0 0 0\n";
  const Imported file =
      import_ply(square, "a.ply", [&](std::string_view name) { return std::optional(folder.path() / name); });
  EXPECT_EQ(mesh(file).triangles, (Triangles{{0, 1, 2}, {0, 4, 3}, {0, 5, 6}}));
  EXPECT_EQ(mesh(file).positions[4], (Vec3{1, 1, 0}));
  EXPECT_EQ(mesh(file).attributes->uvs[0],
            (std::vector<Vec2>{{0, 1}, {1, 1}, {1, 0}, {0, 0}, {0.5F, 0}, {0, 1}, {0, 1}}));
  ASSERT_EQ(file.warnings.size(), 3U);
  EXPECT_EQ(file.warnings[0].detail, "Of the element \"face\" is ignored: texnumber");
  EXPECT_TRUE(file.warnings[1].detail.starts_with("A face that names a vertex that isn't there"));
  EXPECT_EQ(file.warnings[2].detail, "A face without texture coordinates for each corner has 0 0 there");
}

}  // namespace
}  // namespace tessera::proto
