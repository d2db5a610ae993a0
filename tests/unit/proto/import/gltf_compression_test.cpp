#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <draco/attributes/geometry_attribute.h>
#include <draco/compression/encode.h>
#include <draco/mesh/mesh.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include "proto/import/broken_file.h"
#include "proto/import/gltf/gltf.h"
#include "tests/support/gltf_builder.h"

namespace tessera::proto {
namespace {

constexpr std::uint32_t kSide = 16;  // vertices along each side of a wavy square

std::vector<float> positions() {
  std::vector<float> out;
  for (std::uint32_t y = 0; y < kSide; ++y)
    for (std::uint32_t x = 0; x < kSide; ++x)
      out.insert(out.end(), {static_cast<float>(x), static_cast<float>(y), 0.25F * static_cast<float>((x * y) % 3)});
  return out;
}

std::vector<std::uint32_t> indices() {
  std::vector<std::uint32_t> out;
  for (std::uint32_t y = 0; y + 1 < kSide; ++y) {
    for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
      const std::uint32_t a = y * kSide + x, b = a + 1, c = a + kSide, d = c + 1;
      out.insert(out.end(), {a, b, d, a, d, c});
    }
  }
  return out;
}

GltfBuilder plain() {
  GltfBuilder file;
  file.add_triangle();
  file.primitive()["attributes"]["POSITION"] = file.add_positions(positions());
  file.primitive()["indices"] = file.add_accessor(indices(), "SCALAR", GltfBuilder::kUint32, 1);
  return file;
}

Imported read(std::string_view bytes) { return import_gltf(bytes, "a.glb", nullptr, {}, 1 << 24); }

std::string error_of(std::string_view bytes) {
  try {
    read(bytes);
  } catch (const BrokenFile& broken) {
    return broken.errors.front().pointer;
  }
  return "none";
}

/// The triangles by the places of their corners, the smallest corner first: encoders change the order.
using Corners = std::array<std::array<float, 3>, 3>;
std::vector<Corners> triangles_of(const Imported& imported) {
  const auto& mesh = std::get<TriangleMesh>(imported.parts.at(0).shape);
  std::vector<Corners> out;
  for (const TriangleIndices& t : mesh.triangles) {
    Corners corners;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 p = mesh.positions[t[i]];
      corners[i] = {p.x, p.y, p.z};
    }
    std::ranges::rotate(corners, std::ranges::min_element(corners));
    out.push_back(corners);
  }
  std::ranges::sort(out);
  return out;
}

// Draco.

std::string draco_bytes(int quantization, int speed) {
  draco::Mesh mesh;
  const auto points = positions();
  const auto corners = indices();
  const auto count = static_cast<std::uint32_t>(points.size() / 3);
  mesh.set_num_points(count);
  draco::GeometryAttribute attribute;
  attribute.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 12, 0);
  const int id = mesh.AddAttribute(attribute, true, count);
  for (std::uint32_t i = 0; i < count; ++i)
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &points[i * 3]);
  for (std::size_t i = 0; i < corners.size(); i += 3)
    mesh.AddFace({draco::PointIndex(corners[i]), draco::PointIndex(corners[i + 1]), draco::PointIndex(corners[i + 2])});
  draco::Encoder encoder;
  encoder.SetSpeedOptions(speed, speed);
  if (quantization > 0) encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, quantization);
  if (speed == 10) encoder.SetEncodingMethod(draco::MESH_SEQUENTIAL_ENCODING);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(mesh, &buffer).ok());
  return {buffer.data(), buffer.size()};
}

GltfBuilder with_draco(const std::string& bytes) {
  GltfBuilder file = plain();
  for (const char* accessor : {"POSITION"}) {
    auto& a = file.json["accessors"][file.primitive()["attributes"][accessor].get<std::size_t>()];
    a.erase("bufferView");
  }
  file.json["accessors"][file.primitive()["indices"].get<std::size_t>()].erase("bufferView");
  file.buffer.clear();
  file.json.erase("bufferViews");
  file.json["accessors"].erase(0);  // the triangle's
  file.primitive()["attributes"]["POSITION"] = 0;
  file.primitive()["indices"] = 1;
  const std::size_t view = file.add_view(bytes);
  file.primitive()["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", view},
                                                                  {"attributes", {{"POSITION", 0}}}};
  file.json["extensionsUsed"] = {"KHR_draco_mesh_compression"};
  return file;
}

TEST(GltfCompression, DracoGivesTheSameTriangles) {
  for (const int speed : {0, 5, 10}) {
    SCOPED_TRACE(speed);
    GltfBuilder file = with_draco(draco_bytes(0, speed));
    EXPECT_EQ(triangles_of(read(file.glb())), triangles_of(read(plain().glb())));
  }
}

TEST(GltfCompression, DracoIsWithinItsQuantisation) {
  const auto exact = triangles_of(read(plain().glb())),
             coarse = triangles_of(read(with_draco(draco_bytes(12, 5)).glb()));
  ASSERT_EQ(exact.size(), coarse.size());
  std::vector<float> differences;
  float least = 0, most = 0;
  for (const auto& corners : coarse)
    for (const auto& corner : corners) most = std::max(most, std::max(corner[0], corner[1]));
  EXPECT_NEAR(most, kSide - 1, float{kSide - 1} / 4095);
  EXPECT_EQ(least, 0);
}

TEST(GltfCompression, BrokenDracoIsRefused) {
  const std::string good = draco_bytes(11, 5);
  const std::string where = "a.glb/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
  for (std::size_t size = 1; size + 16 < good.size(); size += 7)
    EXPECT_EQ(error_of(with_draco(good.substr(0, size)).glb()), where) << size;
  EXPECT_EQ(error_of(with_draco("DRACO").glb()), where);
  // 2^28 − 1 vertices and faces: "DRACO", version 2.2, an edgebreaker mesh, no flags, its traversal, the counts.
  const std::string claims =
      std::string("DRACO\2\2\1\1\0\0\0", 12) + "\xFF\xFF\xFF\x7F" + "\xFF\xFF\xFF\x7F" + good.substr(20);
  EXPECT_EQ(error_of(with_draco(claims).glb()), where);
}

TEST(GltfCompression, ConnectivitiesOfAttributesCountAsMemory) {
  const auto detail = [](char connectivities) {
    // An edgebreaker mesh of 2,048 vertices and 4,096 faces, as its header says, which aren't there.
    const std::string claims = std::string("DRACO\2\2\1\1\0\0\0", 12) + "\x80\x10" + "\x80\x20" + connectivities;
    try {
      read(with_draco(claims).glb());
    } catch (const BrokenFile& broken) {
      return broken.errors.front().detail;
    }
    return std::string("none");
  };
  EXPECT_NE(detail('\xFF').find("far more memory"), std::string::npos) << detail('\xFF');
  EXPECT_NE(detail('\1').find("is broken"), std::string::npos) << detail('\1');
}

/// A triangle, in three attributes of places, each one higher, and joints and weights.
std::string draco_triangle(std::uint8_t joint) {
  draco::Mesh mesh;
  mesh.set_num_points(3);
  const auto add = [&](draco::GeometryAttribute::Type type, std::int8_t components, draco::DataType of,
                       const auto& values) {
    draco::GeometryAttribute attribute;
    const auto stride = static_cast<std::int64_t>(static_cast<std::size_t>(components) * sizeof(values[0]));
    attribute.Init(type, nullptr, components, of, false, stride, 0);
    const int id = mesh.AddAttribute(attribute, true, 3);
    for (std::uint32_t i = 0; i < 3; ++i)
      mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i),
                                            &values[i * static_cast<std::size_t>(components)]);
  };
  for (const float z : {0.0F, 1.0F})
    add(z == 0 ? draco::GeometryAttribute::POSITION : draco::GeometryAttribute::GENERIC, 3, draco::DT_FLOAT32,
        std::vector<float>{0, 0, z, 1, 0, z, 0, 1, z});
  add(draco::GeometryAttribute::GENERIC, 4, draco::DT_UINT8,
      std::vector<std::uint8_t>{0, 0, 0, 0, 0, 0, 0, 0, joint, 0, 0, 0});
  add(draco::GeometryAttribute::GENERIC, 4, draco::DT_FLOAT32, std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  mesh.AddFace({draco::PointIndex(0), draco::PointIndex(1), draco::PointIndex(2)});
  draco::Encoder encoder;
  encoder.SetEncodingMethod(draco::MESH_SEQUENTIAL_ENCODING);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(mesh, &buffer).ok());
  return {buffer.data(), buffer.size()};
}

GltfBuilder draco_file(const std::string& bytes) {
  GltfBuilder file;
  file.add_triangle();
  file.json["accessors"][0].erase("bufferView");
  file.json.erase("bufferViews");
  file.buffer.clear();
  file.primitive()["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", file.add_view(bytes)},
                                                                  {"attributes", {{"POSITION", 0}}}};
  file.json["extensionsUsed"] = {"KHR_draco_mesh_compression"};
  return file;
}

TEST(GltfCompression, JointsOfDracoThatArentThereAreRefused) {
  const auto error = [](std::uint8_t joint) {
    GltfBuilder file = draco_file(draco_triangle(joint));
    file.json["accessors"].push_back({{"componentType", GltfBuilder::kUint8}, {"count", 3}, {"type", "VEC4"}});
    file.json["accessors"].push_back({{"componentType", GltfBuilder::kFloat}, {"count", 3}, {"type", "VEC4"}});
    file.primitive()["attributes"]["JOINTS_0"] = 1;
    file.primitive()["attributes"]["WEIGHTS_0"] = 2;
    auto& ids = file.primitive()["extensions"]["KHR_draco_mesh_compression"]["attributes"];
    ids["JOINTS_0"] = 2;
    ids["WEIGHTS_0"] = 3;
    file.json["skins"] = {{{"joints", {1}}}};
    file.json["nodes"] = {{{"mesh", 0}, {"skin", 0}}, {{"translation", {0, 0, 5}}}};
    file.json["scenes"][0]["nodes"] = {0, 1};
    return error_of(file.glb());
  };
  EXPECT_EQ(error(0), "none");
  for (const std::uint8_t joint : {1, 255}) EXPECT_EQ(error(joint), "a.glb/meshes/0/primitives/0") << int{joint};
}

TEST(GltfCompression, OtherAttributesOfADracoMeshAreAnotherMesh) {
  GltfBuilder file = draco_file(draco_triangle(0));
  auto second = file.primitive();
  second["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 1;
  file.json["meshes"][0]["primitives"].push_back(second);
  const Imported imported = read(file.glb());
  ASSERT_EQ(imported.parts.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(std::get<TriangleMesh>(imported.parts[i].shape).positions.at(0).z, static_cast<float>(i));
}

// meshopt.

template <typename T>
std::string as_bytes(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

void compress(GltfBuilder& file, std::size_t accessor, const std::string& encoded, const char* mode, std::size_t stride,
              std::size_t count, const char* filter = "NONE") {
  const std::size_t view = file.json["accessors"][accessor]["bufferView"].get<std::size_t>();
  const std::size_t from = file.add_view(encoded);
  file.json["bufferViews"][view]["buffer"] = 1;
  file.json["bufferViews"][view]["byteOffset"] = 0;
  file.json["bufferViews"][view]["extensions"]["EXT_meshopt_compression"] = {
      {"buffer", 0},
      {"byteOffset", file.json["bufferViews"][from]["byteOffset"]},
      {"byteLength", encoded.size()},
      {"byteStride", stride},
      {"count", count},
      {"mode", mode},
      {"filter", filter}};
  file.json["buffers"][1] = {{"byteLength", 1 << 20}};
}

std::string encoded_vertices(const std::vector<float>& values, std::size_t stride) {
  std::vector<unsigned char> out(meshopt_encodeVertexBufferBound(values.size() * 4 / stride, stride));
  out.resize(meshopt_encodeVertexBuffer(out.data(), out.size(), values.data(), values.size() * 4 / stride, stride));
  return as_bytes(out);
}

TEST(GltfCompression, MeshoptGivesTheSameMesh) {
  GltfBuilder file = plain();
  file.json["extensionsUsed"] = {"EXT_meshopt_compression"};
  const auto corners = indices();
  std::vector<unsigned char> out(meshopt_encodeIndexBufferBound(corners.size(), positions().size() / 3));
  out.resize(meshopt_encodeIndexBuffer(out.data(), out.size(), corners.data(), corners.size()));
  const std::size_t p = file.primitive()["attributes"]["POSITION"], i = file.primitive()["indices"];
  compress(file, p, encoded_vertices(positions(), 12), "ATTRIBUTES", 12, kSide * kSide);
  compress(file, i, as_bytes(out), "TRIANGLES", 4, corners.size());
  EXPECT_EQ(triangles_of(read(file.glb())), triangles_of(read(plain().glb())));

  auto& extension = file.json["bufferViews"][1]["extensions"]["EXT_meshopt_compression"];
  const auto good = extension;
  extension["byteLength"] = good["byteLength"].get<std::size_t>() / 2;
  EXPECT_EQ(error_of(file.glb()), "a.glb/bufferViews/1/extensions/EXT_meshopt_compression");
  extension = good;
  extension["count"] = 1'000'000;
  EXPECT_EQ(error_of(file.glb()), "a.glb/bufferViews/1/extensions/EXT_meshopt_compression/count");
  extension = good;
  extension["filter"] = "OCTAHEDRAL";  // of 4 or 8 bytes
  EXPECT_EQ(error_of(file.glb()), "a.glb/bufferViews/1/extensions/EXT_meshopt_compression/byteStride");
}

TEST(GltfCompression, MeshoptsSequencesOfIndices) {
  GltfBuilder file = plain();
  const auto corners = indices();
  std::vector<unsigned char> out(meshopt_encodeIndexSequenceBound(corners.size(), positions().size() / 3));
  out.resize(meshopt_encodeIndexSequence(out.data(), out.size(), corners.data(), corners.size()));
  compress(file, file.primitive()["indices"], as_bytes(out), "INDICES", 4, corners.size());
  EXPECT_EQ(triangles_of(read(file.glb())), triangles_of(read(plain().glb())));
}

TEST(GltfCompression, MeshoptsFiltersAreUndone) {
  GltfBuilder file;
  file.add_triangle();
  const std::vector<float> normals{0, 0, 1, 0, 0, 0.6F, 0.8F, 0, -1, 0, 0, 0};
  std::vector<std::int8_t> packed(12);
  meshopt_encodeFilterOct(packed.data(), 3, 4, 8, normals.data());
  std::vector<float> as_floats(3);
  std::memcpy(as_floats.data(), packed.data(), 12);
  file.json["extensionsUsed"] = {"EXT_meshopt_compression", "KHR_mesh_quantization"};
  const std::size_t accessor = file.add_accessor(packed, "VEC3", 5120, 4);
  file.json["accessors"][accessor]["normalized"] = true;
  file.json["bufferViews"][1]["byteStride"] = 4;
  file.primitive()["attributes"]["NORMAL"] = accessor;
  compress(file, accessor, encoded_vertices(as_floats, 4), "ATTRIBUTES", 4, 3, "OCTAHEDRAL");
  const Imported imported = read(file.glb());
  const auto& mesh = std::get<TriangleMesh>(imported.parts.at(0).shape);
  for (std::size_t i = 0; i < 3; ++i)
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(mesh.normals[i][axis], normals[i * 4 + static_cast<std::size_t>(axis)], 2.0 / 127) << i;
}

}  // namespace
}  // namespace tessera::proto
