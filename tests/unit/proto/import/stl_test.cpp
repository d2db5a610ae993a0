#include "proto/import/stl.h"

#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "proto/import/broken_file.h"
#include "proto/import/shared_points.h"

namespace tessera::proto {
namespace {

using Corners = std::vector<Vec3>;

Imported read_stl(std::string_view bytes) { return import_stl(bytes, "a.stl"); }

std::string stl_error_of(std::string_view bytes) {
  try {
    read_stl(bytes);
    return "none";
  } catch (const BrokenFile& broken) {
    return broken.errors.at(0).pointer + ": " + broken.errors.at(0).detail;
  }
}

void append(std::string& bytes, std::uint32_t value, int size = 4) {
  for (int i = 0; i < size; ++i) bytes += static_cast<char>(value >> 8 * i & 0xFF);
}

/// A binary file of triangles, three corners each.
std::string binary(const Corners& corners, std::string header = "by hand", std::uint32_t spare = 0) {
  header.resize(80);
  append(header, static_cast<std::uint32_t>(corners.size() / 3));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i % 3 == 0) header += std::string(12, '\x7F');  // A normal that nobody can use.
    for (const float v : {corners[i].x, corners[i].y, corners[i].z}) append(header, std::bit_cast<std::uint32_t>(v));
    if (i % 3 == 2) append(header, spare, 2);
  }
  return header;
}

/// The triangles of the only mesh, as their corners, one after the other.
Corners corners_of(const Imported& file) {
  Corners corners;
  const auto& mesh = std::get<TriangleMesh>(file.parts.at(0).shape);
  for (const TriangleIndices& t : mesh.triangles)
    for (const std::uint32_t i : t) corners.push_back(mesh.positions.at(i));
  return corners;
}

std::size_t vertices_of(const Imported& file) {
  return std::get<TriangleMesh>(file.parts.at(0).shape).positions.size();
}

const Corners kTwo{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}};

TEST(Stl, Binary) {
  const Imported file = read_stl(binary(kTwo));
  EXPECT_EQ(corners_of(file), kTwo);
  EXPECT_EQ(vertices_of(file), 4U) << "corners in one place are one vertex";
  EXPECT_TRUE(std::get<TriangleMesh>(file.parts[0].shape).normals.empty());
  EXPECT_EQ(file.parts[0].material, std::nullopt);
  EXPECT_TRUE(file.warnings.empty());
}

TEST(Stl, BinaryThatBeginsAsTextDoes) {
  EXPECT_EQ(corners_of(read_stl(binary(kTwo, "solid by some program" + std::string(59, ' ')))), kTwo);
  const std::string longer = binary(kTwo, "solid by some program") + "more";
  EXPECT_EQ(corners_of(read_stl(longer)), kTwo) << "text holds no 0";
}

TEST(Stl, BinaryWhoseCountIsWrong) {
  const std::string good = binary(kTwo);
  EXPECT_EQ(stl_error_of(good.substr(0, good.size() - 1)),
            "a.stl: The file is cut off: at byte 80 it counts 2 triangles, of which 1 are there");
  std::string huge = good;
  huge.replace(80, 4, "\xFF\xFF\xFF\xFF");
  EXPECT_EQ(stl_error_of(huge),
            "a.stl: The file is cut off: at byte 80 it counts 4294967295 triangles, of which 2 are there");
  for (const std::size_t size : {0U, 1U, 83U})
    EXPECT_EQ(stl_error_of(good.substr(0, size)),
              "a.stl: An STL file that isn't text has a header of 84 bytes, and this one ends before");
  const Imported longer = read_stl(good + "x");
  EXPECT_EQ(corners_of(longer), kTwo);
  ASSERT_EQ(longer.warnings.size(), 1U);
  EXPECT_EQ(longer.warnings[0].detail, "What follows the last triangle, from byte 184, is ignored");
  const Imported empty = read_stl(binary({}));
  EXPECT_TRUE(empty.parts.empty());
  EXPECT_EQ(empty.warnings.at(0).detail, "The file has no triangles");
}

TEST(Stl, WhatTrianglesSayBesideTheirCornersIsTold) {
  const Imported file = read_stl(binary(kTwo, "COLOR=\x01\x02\x03\x04", 0x8001));
  EXPECT_EQ(corners_of(file), kTwo);
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_TRUE(file.warnings[0].detail.ends_with("was ignored (2 times)")) << file.warnings[0].detail;
}

TEST(Stl, TrianglesThatCannotBeSeenAreDroppedAndCounted) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Corners corners{{nan, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {-0.0F, 0, 0}, {1, 1, 0}};
  EXPECT_TRUE(stl_error_of(binary(corners)).starts_with("a.stl: A triangle with a coordinate that is NaN"));
  corners.insert(corners.end(), kTwo.begin(), kTwo.end());
  const Imported file = read_stl(binary(corners));
  EXPECT_EQ(corners_of(file), kTwo);
  ASSERT_EQ(file.warnings.size(), 2U);
  EXPECT_EQ(file.warnings[1].detail, "A triangle with two corners in one place was dropped");
}

const std::string kLoop = "outer loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\n";
const Corners kOne{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}};

TEST(Stl, Text) {
  const Imported file = read_stl("solid a b facets\nfacet normal 0 0 1\n" + kLoop + "endfacet\nendsolid a b\n");
  EXPECT_EQ(corners_of(file), kOne);
  EXPECT_TRUE(file.warnings.empty());
}

TEST(Stl, TextInEveryForm) {
  std::string upper =
      "SOLID\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 1e0 0 0\nVERTEX +1. 1.0E+0 0\nENDLOOP\n"
      "ENDFACET\nENDSOLID\n";
  EXPECT_EQ(corners_of(read_stl(upper)), kOne);
  for (const char* normal : {"0 0 1", "nan nan nan", "-nan(ind) 0 0", "0 0", "", "1.#IND 1.#IND 1.#IND"}) {
    std::string text =
        std::string("\xEF\xBB\xBF \nsolid a\n facet normal ") + normal + "\n" + kLoop + "endfacet\nendsolid";
    for (const char* end : {"\n", "\r\n", "\r", "\n\n"}) {
      std::string with_ends;
      for (const char c : text) c == '\n' ? with_ends += end : with_ends += c;
      const Imported file = read_stl(with_ends);
      EXPECT_EQ(corners_of(file), kOne) << normal;
      EXPECT_TRUE(file.warnings.empty()) << normal;
    }
  }
  const Imported one_line = read_stl(
      "solid a facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 1 1 0 "
      "endloop endfacet facet outer loop vertex 0 0 0 vertex 1 0 0 vertex 1 1 0 endloop "
      "endfacet endsolid a");
  EXPECT_EQ(corners_of(one_line).size(), 6U);
  EXPECT_TRUE(one_line.warnings.empty());
}

TEST(Stl, SolidsOfATextAreOneMesh) {
  const std::string solid = "solid\nfacet normal 0 0 1\n" + kLoop + "endfacet\nendsolid\n";
  const Imported file = read_stl(solid + "\n" + solid);
  EXPECT_EQ(file.parts.size(), 1U);
  EXPECT_EQ(corners_of(file).size(), 6U);
  EXPECT_EQ(vertices_of(file), 3U);
}

TEST(Stl, TextThatIsNotAsItShouldBe) {
  EXPECT_EQ(stl_error_of("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 zero 0\n"),
            "a.stl:5: Three numbers are expected after \"vertex\"");
  EXPECT_EQ(stl_error_of("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0"),
            "a.stl:4: Three numbers are expected after \"vertex\"");
  EXPECT_EQ(
      stl_error_of("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid"),
      "a.stl:6: A facet with less than 3 corners was dropped");
  const std::string facet = "facet normal 0 0 1\n" + kLoop + "endfacet\n";
  const std::pair<std::string, std::string> texts[] = {
      {"solid\n" + facet, "a.stl:9: The file ends before its solid does"},
      {"solid\n" + facet + "color 1 0 0\nendsolid", "a.stl:9: A statement that STL doesn't have was ignored"},
      {"solid\n" + facet + "facet normal 0 0 1\nouter loop\nvertex 1 2 3\nendfacet\nendsolid",
       "a.stl:12: A facet that has no \"endloop\" was dropped"}};
  for (const auto& [text, words] : texts) {
    const Imported file = read_stl(text);
    EXPECT_EQ(corners_of(file), kOne);
    ASSERT_EQ(file.warnings.size(), 1U) << text;
    EXPECT_EQ(file.warnings[0].pointer + ": " + file.warnings[0].detail, words);
  }
  const Imported quad = read_stl(
      "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\n"
      "endloop\nendfacet\nendsolid");
  EXPECT_EQ(corners_of(quad).size(), 6U);
  EXPECT_TRUE(read_stl("solid nothing\nendsolid nothing\n").parts.empty());
}

TEST(SharedPoints, NumbersPlaces) {
  SharedPoints points;
  EXPECT_EQ(points.number({1, 2, 3}), 0U);
  EXPECT_EQ(points.number({1, 2, 0}), 1U);
  EXPECT_EQ(points.number({1, 2, -0.0F}), 1U);
  EXPECT_EQ(points.number({1, 2, 3}), 0U);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(points.number({7, static_cast<float>(i), 7}), i + 2U);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(points.number({7, static_cast<float>(i), 7}), i + 2U);
  EXPECT_EQ(points.points().size(), 1002U);
}

}  // namespace
}  // namespace tessera::proto
