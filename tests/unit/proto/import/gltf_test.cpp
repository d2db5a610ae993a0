#include "proto/import/gltf/gltf.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "proto/import/broken_file.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/png_bytes.h"

namespace tessera::proto {
namespace {

using Json = nlohmann::json;

Imported read(std::string_view bytes, const ImportOptions& options = {}) {
  return import_gltf(bytes, "a.glb", nullptr, options, 1 << 24);
}
Imported read(GltfBuilder& file, const ImportOptions& options = {}) { return read(file.glb(), options); }

std::vector<std::string> errors_of(std::string_view bytes) {
  std::vector<std::string> errors;
  try {
    read(bytes);
  } catch (const BrokenFile& broken) {
    for (const FieldError& error : broken.errors) errors.push_back(error.pointer);
  }
  return errors;
}
std::string place_of_error(std::string_view bytes) {
  const auto errors = errors_of(bytes);
  return errors.empty() ? "none" : errors.front();
}
std::string place_of_error(GltfBuilder& file) { return place_of_error(file.glb()); }

GltfBuilder triangle() {
  GltfBuilder file;
  file.add_triangle();
  return file;
}

const TriangleMesh& mesh(const Imported& file, std::size_t part = 0) {
  return std::get<TriangleMesh>(file.parts.at(part).shape);
}

std::string warnings_of(const Imported& file) {
  std::string text;
  for (const SceneWarning& warning : file.warnings) text += warning.pointer + ": " + warning.detail + "\n";
  return text;
}

using Triangles = std::vector<TriangleIndices>;
using Positions = std::vector<Vec3>;

// The container.

TEST(Gltf, AGlbAndItsTextWithADataUriAreTheSame) {
  GltfBuilder file = triangle();
  const Imported binary = read(file);
  // 36 bytes: three corners of three floats.
  file.json["buffers"][0] = {
      {"byteLength", 36},
      {"uri", "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}};
  const Imported text = read(file.json.dump());
  EXPECT_EQ(mesh(text).positions, (Positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh(binary).positions, mesh(text).positions);
  EXPECT_EQ(mesh(binary).triangles, (Triangles{{0, 1, 2}}));
  EXPECT_TRUE(mesh(binary).normals.empty());
  EXPECT_TRUE(binary.placements.empty());
}

TEST(Gltf, LengthsOfAGlbThatLieAreRefused) {
  GltfBuilder file = triangle();
  const std::string good = file.glb();
  EXPECT_EQ(place_of_error(good), "none");
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_NE(place_of_error(good.substr(0, size)), "none") << size;
  }
  const auto changed = [&](std::size_t at, std::uint32_t value) {
    std::string bytes = good;
    return bytes.replace(at, 4, GltfBuilder::word(value));
  };
  EXPECT_EQ(place_of_error(changed(4, 1)), "a.glb");            // the version
  EXPECT_EQ(place_of_error(changed(8, 0xFFFFFFFF)), "a.glb");   // the whole
  EXPECT_EQ(place_of_error(changed(12, 0xFFFFFFFC)), "a.glb");  // the JSON chunk
  EXPECT_EQ(place_of_error(changed(12, 1)), "a.glb");
  EXPECT_EQ(place_of_error(changed(16, 0x004E4942)), "a.glb");  // which isn't one
}

TEST(Gltf, DataUrisThatLieAreRefused) {
  GltfBuilder file = triangle();
  file.json["buffers"][0]["byteLength"] = 36;
  const std::string head = "data:application/octet-stream;base64,";
  for (const std::string& uri :
       {head + "AAAA", head + "AAA!AAAA", head + std::string(49, 'A'), std::string("data:;base64"),
        "data:image/png;base64," + std::string(48, 'A'),
        "data:application/octet-stream;;base64," + std::string(48, 'A'), std::string("http://example.com/a.bin"),
        std::string("file:///etc/passwd"), std::string("/etc/passwd"), std::string("../a.bin"),
        std::string("a/../../b.bin"), std::string("%2e%2e/a.bin"), std::string("missing.bin")}) {
    file.json["buffers"][0]["uri"] = uri;
    EXPECT_EQ(place_of_error(file.json.dump()).substr(0, 15), "a.glb/buffers/0") << uri;
  }
  file.json["buffers"][0]["uri"] = head + std::string(48, 'A');
  EXPECT_EQ(place_of_error(file.json.dump()), "none");
}

TEST(Gltf, CompanionsAreAskedForByTheirNameWithoutEscapes) {
  GltfBuilder file = triangle();
  file.json["buffers"][0] = {{"byteLength", 36}, {"uri", "./a%20b/x.bin"}};
  std::string asked;
  EXPECT_THROW(import_gltf(
                   file.json.dump(), "a.gltf",
                   [&](std::string_view name) {
                     asked = name;
                     return std::nullopt;
                   },
                   {}, 1 << 24),
               BrokenFile);
  EXPECT_EQ(asked, "a b/x.bin");
}

TEST(Gltf, TwentyFaultsAreSaidAtOnce) {
  GltfBuilder file = triangle();
  for (int i = 0; i < 30; ++i) file.json["materials"].push_back({{"pbrMetallicRoughness", {{"metallicFactor", 2}}}});
  EXPECT_EQ(errors_of(file.glb()).size(), 20U);
  EXPECT_EQ(place_of_error(file), "a.glb/materials/0/pbrMetallicRoughness/metallicFactor");
}

// Accessors.

TEST(Gltf, RangesThatOverflowAreRefused) {
  for (const std::uint64_t huge : {std::uint64_t{37}, std::uint64_t{1} << 32, std::uint64_t{1} << 52}) {
    GltfBuilder file = triangle();
    file.json["bufferViews"][0]["byteLength"] = huge;
    EXPECT_EQ(place_of_error(file), "a.glb/bufferViews/0/byteLength");
    file = triangle();
    file.json["accessors"][0]["byteOffset"] = huge / 4 * 4;
    EXPECT_EQ(place_of_error(file), "a.glb/accessors/0");
  }
  GltfBuilder file = triangle();
  file.json["accessors"][0]["count"] = 4294967295U;
  EXPECT_EQ(place_of_error(file), "a.glb/accessors/0");
}

TEST(Gltf, ZerosTakeNoMoreMemoryThanAFileMay) {
  GltfBuilder file = triangle();
  file.json["accessors"][0].erase("bufferView");
  file.json["accessors"][0]["count"] = 4294967293U;
  EXPECT_EQ(place_of_error(file), "a.glb/meshes/0/primitives/0");
}

TEST(Gltf, IndicesOfEveryWidth) {
  const auto with = [](const auto& indices, int component) {
    GltfBuilder file = triangle();
    const std::size_t accessor = file.add_accessor(indices, "SCALAR", component, 1);
    file.primitive()["indices"] = accessor;
    return mesh(read(file)).triangles;
  };
  EXPECT_EQ(with(std::vector<std::uint8_t>{2, 1, 0}, GltfBuilder::kUint8), (Triangles{{2, 1, 0}}));
  EXPECT_EQ(with(std::vector<std::uint16_t>{2, 1, 0}, GltfBuilder::kUint16), (Triangles{{2, 1, 0}}));
  EXPECT_EQ(with(std::vector<std::uint32_t>{2, 1, 0}, GltfBuilder::kUint32), (Triangles{{2, 1, 0}}));
}

TEST(Gltf, IndicesOutOfRangeAndRestartsAreRefused) {
  for (const std::uint8_t index : {3, 255}) {
    GltfBuilder file = triangle();
    const std::size_t accessor =
        file.add_accessor(std::vector<std::uint8_t>{0, 1, index}, "SCALAR", GltfBuilder::kUint8, 1);
    file.primitive()["indices"] = accessor;
    EXPECT_EQ(place_of_error(file), "a.glb/accessors/1");
  }
  GltfBuilder file = triangle();
  const std::size_t positions = file.add_positions(std::vector<float>(300 * 3));
  file.primitive()["attributes"]["POSITION"] = positions;
  file.primitive()["indices"] =
      file.add_accessor(std::vector<std::uint8_t>{0, 1, 255}, "SCALAR", GltfBuilder::kUint8, 1);
  EXPECT_EQ(place_of_error(file), "a.glb/accessors/2");
}

TEST(Gltf, StripsAndFansKeepTheirTurn) {
  GltfBuilder file = triangle();
  file.primitive()["attributes"]["POSITION"] = file.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0});
  file.primitive()["mode"] = 5;
  EXPECT_EQ(mesh(read(file)).triangles, (Triangles{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}}));
  file.primitive()["mode"] = 6;
  EXPECT_EQ(mesh(read(file)).triangles, (Triangles{{1, 2, 0}, {2, 3, 0}, {3, 4, 0}}));
  file.primitive()["mode"] = 1;
  EXPECT_EQ(
      warnings_of(read(file)),
      "a.glb/meshes/0/primitives/0: Points and lines aren't shown\na.glb: The file has no surfaces that are seen\n");
}

TEST(Gltf, SparseValuesReplaceZerosAndOthers) {
  GltfBuilder file = triangle();
  const std::vector<std::uint16_t> indices{0, 2};
  const std::vector<float> values{5, 6, 7, 8, 9, 10};
  const std::size_t where = file.add_view({reinterpret_cast<const char*>(indices.data()), 4});
  const std::size_t what = file.add_view({reinterpret_cast<const char*>(values.data()), 24});
  file.json["accessors"][0]["sparse"] = {
      {"count", 2}, {"indices", {{"bufferView", where}, {"componentType", 5123}}}, {"values", {{"bufferView", what}}}};
  EXPECT_EQ(mesh(read(file)).positions, (Positions{{5, 6, 7}, {1, 0, 0}, {8, 9, 10}}));
  file.json["accessors"][0].erase("bufferView");
  EXPECT_EQ(mesh(read(file)).positions, (Positions{{5, 6, 7}, {0, 0, 0}, {8, 9, 10}}));
  file.json["accessors"][0]["sparse"]["count"] = 4;
  EXPECT_EQ(place_of_error(file), "a.glb/accessors/0/sparse/count");
  file = triangle();
}

TEST(Gltf, NormalisedNumbersAreFractionsOfTheLargest) {
  GltfBuilder file = triangle();
  const std::size_t colors = file.add_accessor(
      std::vector<std::uint8_t>{255, 51, 0, 255, 0, 0, 0, 0, 255, 255, 255, 102}, "VEC4", GltfBuilder::kUint8, 4);
  const std::size_t uvs =
      file.add_accessor(std::vector<std::uint16_t>{0, 65535, 13107, 0, 0, 0}, "VEC2", GltfBuilder::kUint16, 2);
  file.json["accessors"][colors]["normalized"] = true;
  file.json["accessors"][uvs]["normalized"] = true;
  file.primitive()["attributes"]["COLOR_0"] = colors;
  file.primitive()["attributes"]["TEXCOORD_0"] = uvs;
  const Imported imported = read(file);
  const MeshAttributes& attributes = *mesh(imported).attributes;
  EXPECT_EQ(attributes.colors[0], (std::array<float, 4>{1, 0.2F, 0, 1}));
  EXPECT_EQ(attributes.colors[2], (std::array<float, 4>{1, 1, 1, 0.4F}));
  EXPECT_EQ(attributes.uvs[0][0], (Vec2{0, 1}));
  EXPECT_EQ(attributes.uvs[0][1], (Vec2{0.2F, 0}));
  EXPECT_TRUE(imported.materials[0].has_vertex_colors);
  EXPECT_FALSE(imported.materials[0].has_vertex_alpha);  // it is opaque
}

TEST(Gltf, NumbersThatNoVertexHasAreMendedAndTold) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  GltfBuilder file = triangle();
  file.primitive()["attributes"]["POSITION"] =
      file.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 1, 2, 2, 2, kNan, 0, 0});
  file.primitive()["attributes"]["TEXCOORD_0"] = file.add_floats({kNan, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0}, 2);
  file.primitive()["attributes"]["COLOR_0"] =
      file.add_floats({kNan, 2, -1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}, 3);
  const Imported imported = read(file);
  EXPECT_EQ(mesh(imported).triangles, (Triangles{{0, 1, 2}}));
  EXPECT_EQ(mesh(imported).attributes->uvs[0][0], (Vec2{0, 0}));
  EXPECT_EQ(mesh(imported).attributes->colors[0], (std::array<float, 4>{0, 1, 0, 1}));
  EXPECT_EQ(imported.warnings.size(), 3U) << warnings_of(imported);
}

TEST(Gltf, AFewOfManyVerticesAreReadAlone) {
  GltfBuilder file = triangle();
  std::vector<float> positions;
  for (int i = 0; i < 100; ++i)
    positions.insert(positions.end(), {static_cast<float>(i), static_cast<float>(i * i), 1});
  file.primitive()["attributes"]["POSITION"] = file.add_positions(positions);
  file.primitive()["indices"] =
      file.add_accessor(std::vector<std::uint16_t>{90, 10, 50}, "SCALAR", GltfBuilder::kUint16, 1);
  EXPECT_EQ(mesh(read(file)).positions, (Positions{{10, 100, 1}, {50, 2500, 1}, {90, 8100, 1}}));
  EXPECT_EQ(mesh(read(file)).triangles, (Triangles{{2, 0, 1}}));
}

// Nodes.

TEST(Gltf, AMeshThatOneNodeShowsIsTakenToTheWorld) {
  GltfBuilder file = triangle();
  file.primitive()["attributes"]["NORMAL"] = file.add_floats({0, 0, 1, 0, 0, 1, 0, 1, 1}, 3);
  file.json["nodes"] = {{{"children", {1}}, {"translation", {10, 0, 0}}},
                        {{"mesh", 0}, {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}, {"scale", {2, 1, 4}}}};
  const Imported imported = read(file);
  EXPECT_TRUE(imported.placements.empty());
  // Scaled, turned by 90° about z, moved.
  const Positions expected{{10, 0, 0}, {10, 2, 0}, {9, 0, 0}};
  for (std::size_t i = 0; i < 3; ++i) EXPECT_LT(length(mesh(imported).positions[i] - expected[i]), 1e-6) << i;
  // (0, 1, 1) by the inverse's transpose: (0, 1, 1/4), turned.
  const Vec3 normal = mesh(imported).normals[2];
  EXPECT_NEAR(normal.x / normal.z, -4, 1e-5);
  EXPECT_NEAR(normal.y, 0, 1e-6);
}

TEST(Gltf, AMirroredMeshKeepsItsFrontInFront) {
  GltfBuilder file = triangle();
  file.primitive()["attributes"]["NORMAL"] = file.add_floats({0, 0, 1, 0, 0, 1, 0, 0, 1}, 3);
  file.primitive()["attributes"]["TANGENT"] = file.add_floats({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, -1}, 4);
  file.json["nodes"][0]["scale"] = {-1, 1, 1};
  const Imported imported = read(file);
  EXPECT_EQ(mesh(imported).positions[1], (Vec3{-1, 0, 0}));
  EXPECT_EQ(mesh(imported).triangles, (Triangles{{0, 2, 1}}));
  EXPECT_EQ(mesh(imported).normals[0], (Vec3{0, 0, 1}));
  const auto& tangents = mesh(imported).attributes->tangents;
  EXPECT_EQ(tangents[0].direction, (Vec3{-1, 0, 0}));
  EXPECT_EQ(tangents[0].sign, -1);
  EXPECT_EQ(tangents[2].sign, 1);
}

TEST(Gltf, AMeshThatSeveralNodesShowIsOnePart) {
  GltfBuilder file = triangle();
  file.json["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}, {"translation", {1, 2, 3}}}, {{"mesh", 0}, {"scale", {1, 0, 1}}}};
  file.json["scenes"][0]["nodes"] = {0, 1, 2};
  const Imported imported = read(file);
  ASSERT_EQ(imported.parts.size(), 1U);
  ASSERT_EQ(imported.placements.size(), 2U);  // the third one is flat
  EXPECT_FALSE(imported.placements[0].placement);
  EXPECT_EQ(imported.placements[1].placement->point_to_world({0, 0, 0}), (Vec3d{1, 2, 3}));
  EXPECT_NE(warnings_of(imported).find("makes it flat"), std::string::npos);
}

TEST(Gltf, TheSameTrianglesWithOtherMaterialsAreOnePart) {
  GltfBuilder file = triangle();
  file.json["materials"] = {{{"emissiveFactor", {1, 0, 0}}}, {{"emissiveFactor", {0, 1, 0}}}};
  Json second = file.primitive();
  file.primitive()["material"] = 0;
  second["material"] = 1;
  file.json["meshes"].push_back({{"primitives", {second}}});
  file.json["nodes"].push_back({{"mesh", 1}});
  file.json["scenes"][0]["nodes"] = {0, 1};
  const Imported imported = read(file);
  ASSERT_EQ(imported.parts.size(), 1U);
  ASSERT_EQ(imported.placements.size(), 2U);
  EXPECT_EQ(imported.materials.at(*imported.placements[1].material).emission, (Rgb{0, 1, 0}));
}

TEST(Gltf, InstancesOfAnExtensionArePlaced) {
  GltfBuilder file = triangle();
  const std::size_t translations = file.add_floats({1, 0, 0, 0, 2, 0}, 3),
                    scales = file.add_floats({1, 1, 1, 2, 2, 2}, 3);
  file.json["nodes"][0]["translation"] = {0, 0, 5};
  file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = {
      {"attributes", {{"TRANSLATION", translations}, {"SCALE", scales}}}};
  const Imported imported = read(file);
  ASSERT_EQ(imported.placements.size(), 2U);
  EXPECT_EQ(imported.placements[0].placement->point_to_world({1, 1, 1}), (Vec3d{2, 1, 6}));
  EXPECT_EQ(imported.placements[1].placement->point_to_world({1, 1, 1}), (Vec3d{2, 4, 7}));
}

TEST(Gltf, AMeshWithASkinStandsAsItsJointsDo) {
  GltfBuilder file = triangle();
  file.primitive()["attributes"]["JOINTS_0"] =
      file.add_accessor(std::vector<std::uint8_t>{0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}, "VEC4", GltfBuilder::kUint8, 4);
  file.primitive()["attributes"]["WEIGHTS_0"] = file.add_floats({1, 0, 0, 0, 1, 0, 0, 0, 0.5, 0.5, 0, 0}, 4);
  // The second joint's space lies one to the right of the mesh's.
  const std::size_t binds = file.add_floats(
      {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1}, 4);
  file.json["accessors"][binds]["type"] = "MAT4";
  file.json["accessors"][binds]["count"] = 2;
  file.json["skins"] = {{{"joints", {1, 2}}, {"inverseBindMatrices", binds}}};
  file.json["nodes"] = {{{"mesh", 0}, {"skin", 0}, {"translation", {100, 0, 0}}},  // which doesn't count
                        {{"translation", {0, 0, 3}}},
                        {{"translation", {5, 0, 0}}}};
  file.json["scenes"][0]["nodes"] = {0, 1, 2};
  EXPECT_EQ(mesh(read(file)).positions, (Positions{{0, 0, 3}, {5, 0, 0}, {2, 1, 1.5F}}));
  file.json["skins"][0]["joints"] = {1};
  EXPECT_EQ(place_of_error(file), "a.glb/meshes/0/primitives/0");
}

TEST(Gltf, JointsThatMirrorTurnTheirTrianglesOver) {
  GltfBuilder file = triangle();
  file.primitive()["attributes"]["POSITION"] =
      file.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0});
  std::vector<float> normals, tangents, weights;
  for (int i = 0; i < 9; ++i) {
    normals.insert(normals.end(), {0, 0, 1});
    tangents.insert(tangents.end(), {1, 0, 0, 1});
    // The last three lie between a joint and its mirror image, which leaves their normals no direction across x.
    weights.insert(weights.end(),
                   i < 6 ? std::initializer_list<float>{1, 0, 0, 0} : std::initializer_list<float>{1, 1, 0, 0});
  }
  file.primitive()["attributes"]["NORMAL"] = file.add_floats(normals, 3);
  file.primitive()["attributes"]["TANGENT"] = file.add_floats(tangents, 4);
  file.primitive()["attributes"]["WEIGHTS_0"] = file.add_floats(weights, 4);
  std::vector<std::uint8_t> joints;
  for (int i = 0; i < 9; ++i)
    for (const int joint : {i < 3 ? 1 : 0, 1, 0, 0}) joints.push_back(static_cast<std::uint8_t>(joint));
  file.primitive()["attributes"]["JOINTS_0"] = file.add_accessor(joints, "VEC4", GltfBuilder::kUint8, 4);
  file.json["skins"] = {{{"joints", {1, 2}}}};
  file.json["nodes"] = {{{"mesh", 0}, {"skin", 0}}, Json::object(), {{"scale", {-1, 1, 1}}}};
  file.json["nodes"][1]["scale"] = {1, 1, 1};
  file.json["scenes"][0]["nodes"] = {0, 1, 2};
  const Imported imported = read(file);
  const TriangleMesh& skinned = mesh(imported);
  // The third one is flat: its corners lie on one line.
  EXPECT_EQ(skinned.triangles, (Triangles{{0, 2, 1}, {3, 4, 5}}));
  EXPECT_EQ(skinned.positions[1], (Vec3{-1, 0, 0}));
  for (const Vec3 normal : skinned.normals) {
    EXPECT_TRUE(is_finite(normal));
    EXPECT_GT(length(normal), 0);
  }
  EXPECT_EQ(skinned.normals[0], (Vec3{0, 0, 1}));
  const auto& turned = skinned.attributes->tangents;
  EXPECT_EQ(turned[0].sign, -1);
  EXPECT_EQ(turned[3].sign, 1);
}

TEST(Gltf, WhatAMaterialLosesIsTold) {
  GltfBuilder file = triangle();
  file.json["extensionsUsed"] = {"KHR_materials_volume", "KHR_materials_clearcoat"};
  file.json["textures"] = {Json::object()};
  file.json["textures"][0]["name"] = "none";
  file.json["materials"] = {{{"extensions",
                              {{"KHR_materials_volume", {{"thicknessFactor", 0.5}}},
                               {"KHR_materials_clearcoat", {{"clearcoatNormalTexture", {{"index", 0}}}}}}}}};
  const std::string place = "a.glb/materials/0/extensions/KHR_materials_";
  EXPECT_EQ(warnings_of(read(file)),
            place + "volume/thicknessFactor: A volume is as thick as its mesh, whatever its thickness says\n" + place +
                "clearcoat/clearcoatNormalTexture: A normal texture of a clear coat is ignored: it is as smooth as the "
                "mesh\n");
}

TEST(Gltf, ADeepTreeIsWalkedAndALoopRefused) {
  GltfBuilder file = triangle();
  constexpr int kDepth = 100'000;
  Json nodes = Json::array();
  for (int i = 0; i < kDepth; ++i) nodes.push_back({{"children", {i + 1}}, {"translation", {1, 0, 0}}});
  nodes.push_back({{"mesh", 0}});
  file.json["nodes"] = nodes;
  EXPECT_EQ(mesh(read(file)).positions[0], (Vec3{kDepth, 0, 0}));
  file.json["nodes"][kDepth]["children"] = {7};
  EXPECT_EQ(place_of_error(file), "a.glb/nodes/100000/children/0");  // a second parent
  file.json["nodes"][6].erase("children");
  EXPECT_EQ(place_of_error(file), "a.glb/nodes/7");
}

TEST(Gltf, AScenesNodesAreSeenAndNoOthers) {
  GltfBuilder file = triangle();
  file.json["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}, {"translation", {1, 0, 0}}}};
  file.json["scenes"] = {{{"nodes", {0}}}, {{"nodes", {1}}}};
  EXPECT_EQ(mesh(read(file)).positions[0].x, 0);
  file.json["scene"] = 1;
  EXPECT_EQ(mesh(read(file)).positions[0].x, 1);
  EXPECT_EQ(mesh(read(file, {.smooth = {}, .variant = {}, .scene = 0})).positions[0].x, 0);
  EXPECT_THROW(read(file, {.smooth = {}, .variant = {}, .scene = 2}), BrokenFile);
  file.json.erase("scene");
  file.json.erase("scenes");
  EXPECT_EQ(read(file).placements.size(), 2U);
}

TEST(Gltf, MatricesThatAreNoPlacementAreRefused) {
  GltfBuilder file = triangle();
  file.json["nodes"][0]["matrix"] = {1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};  // sheared
  EXPECT_EQ(place_of_error(file), "a.glb/nodes/0/matrix");
  file.json["nodes"][0]["matrix"] = {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  EXPECT_EQ(place_of_error(file), "a.glb/nodes/0/matrix");
  file.json["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 4, 5, 1};
  EXPECT_EQ(mesh(read(file)).positions[0], (Vec3{3, 4, 5}));
}

// Materials.

TEST(Gltf, MaterialsHaveWhatTheFileSays) {
  GltfBuilder file = triangle();
  file.json["materials"] = {
      {{"pbrMetallicRoughness",
        {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}}, {"metallicFactor", 0.5}, {"roughnessFactor", 0.25}}},
       {"emissiveFactor", {1, 0.5, 0}},
       {"alphaMode", "MASK"},
       {"alphaCutoff", 0.7},
       {"doubleSided", true},
       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 10}}}}}}};
  file.primitive()["material"] = 0;
  const Imported imported = read(file);
  const Material& material = imported.materials.at(imported.parts[0].material.value());
  const auto& surface = std::get<MetallicRoughness>(material.surface);
  EXPECT_EQ(surface.base_color, (Rgb{0.1F, 0.2F, 0.3F}));
  EXPECT_EQ(surface.metallic, 0.5F);
  EXPECT_EQ(surface.roughness, 0.25F);
  EXPECT_EQ(material.emission, (Rgb{10, 5, 0}));
  EXPECT_TRUE(material.emits_both_sides);
  EXPECT_EQ(material.alpha, 0.4F);
  EXPECT_EQ(material.alpha_cutoff, 0.7F);
}

TEST(Gltf, SpecularAndGlossinessAreMeantWhereAFileHasThem) {
  GltfBuilder file = triangle();
  file.json["extensionsUsed"] = file.json["extensionsRequired"] = {"KHR_materials_pbrSpecularGlossiness"};
  file.json["images"] = {{{"bufferView", file.add_view(png_bytes(4, {9, 9, 9, 9}))}, {"mimeType", "image/png"}}};
  file.json["textures"] = {{{"source", 0}}};
  file.primitive()["attributes"]["TEXCOORD_0"] = file.add_floats({0, 0, 1, 0, 0, 1}, 2);
  file.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {1, 0, 0, 1}}}},
                             {"extensions",
                              {{"KHR_materials_pbrSpecularGlossiness",
                                {{"diffuseFactor", {0.1, 0.2, 0.3, 1}},
                                 {"specularFactor", {0.4, 0.5, 0.6}},
                                 {"glossinessFactor", 0.75},
                                 {"specularGlossinessTexture", {{"index", 0}}}}}}}}};
  file.primitive()["material"] = 0;
  const Imported imported = read(file);
  const Material& material = imported.materials.at(0);
  const auto& surface = std::get<Layered>(material.surface);
  EXPECT_EQ(surface.base_color, (Rgb{0.1F, 0.2F, 0.3F}));
  EXPECT_EQ(surface.specular_color, (Rgb{0.4F, 0.5F, 0.6F}));
  EXPECT_EQ(surface.roughness, 0.25F);
  EXPECT_EQ(surface.metallic, 0);
  EXPECT_EQ(surface.ior, 0);
  ASSERT_EQ(material.textures.size(), 2U);
  EXPECT_EQ(material.textures[0].slot, TextureSlot::specular_color);
  EXPECT_EQ(material.textures[1].slot, TextureSlot::glossiness);
  EXPECT_EQ(material.textures[1].channel, 3);
}

TEST(Gltf, OpaqueMaterialsHaveNoAlpha) {
  GltfBuilder file = triangle();
  file.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.5}}}}, {"alphaCutoff", 0.9}}};
  file.primitive()["material"] = 0;
  EXPECT_FALSE(has_alpha(read(file).materials.at(0)));
  file.json["materials"][0]["alphaMode"] = "BLEND";
  EXPECT_EQ(read(file).materials.at(0).alpha, 0.5F);
  EXPECT_EQ(read(file).materials.at(0).alpha_cutoff, 0);
}

TEST(Gltf, TextureTransformsTurnAsTheExtensionsExampleDoes) {
  GltfBuilder file = triangle();
  const std::string png = "\x89PNG\r\n\x1A\n";
  file.primitive()["attributes"]["TEXCOORD_0"] = file.add_floats({0, 0, 1, 0, 0, 1}, 2);
  // A PNG of one pixel.
  file.json["images"] = {
      {{"uri",
        "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9"
        "awAAAABJRU5ErkJggg=="}}};
  file.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}}};
  file.json["textures"] = {{{"source", 0}, {"sampler", 0}}};
  file.json["materials"] = {
      {{"pbrMetallicRoughness",
        {{"baseColorTexture",
          {{"index", 0},
           {"extensions",
            {{"KHR_texture_transform",
              {{"offset", {0, 1}}, {"rotation", std::numbers::pi / 2}, {"scale", {0.5, 0.5}}}}}}}}}}}};
  file.primitive()["material"] = 0;
  const Imported imported = read(file);
  ASSERT_EQ(imported.textures.size(), 1U) << warnings_of(imported);
  const Texture& texture = imported.textures[0];
  EXPECT_TRUE(texture.is_srgb);
  EXPECT_TRUE(texture.is_nearest);
  EXPECT_EQ(texture.wrap_u, Wrap::clamp);
  EXPECT_EQ(texture.wrap_v, Wrap::mirror);
  // "Utilizes only the lower left quadrant of the source image": u and v from 0 to 1 lead there.
  const auto& m = texture.transform;
  for (const Vec2 uv : {Vec2{0, 0}, Vec2{1, 0}, Vec2{0, 1}, Vec2{1, 1}}) {
    const float u = m[0] * uv.x + m[1] * uv.y + m[2], v = m[3] * uv.x + m[4] * uv.y + m[5];
    EXPECT_NEAR(u, 0.25, 0.2501);
    EXPECT_NEAR(v, 0.75, 0.2501);
  }
  EXPECT_EQ(imported.materials[0].textures.at(0).slot, TextureSlot::base_color);
}

TEST(Gltf, MissingImagesAreLeftOutAndTold) {
  GltfBuilder file = triangle();
  file.primitive()["attributes"]["TEXCOORD_0"] = file.add_floats({0, 0, 1, 0, 0, 1}, 2);
  file.json["images"] = {{{"uri", "http://example.com/a.png"}}};
  file.json["textures"] = {{{"source", 0}}};
  file.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  file.primitive()["material"] = 0;
  const Imported imported = read(file);
  EXPECT_TRUE(imported.textures.empty());
  EXPECT_NE(warnings_of(imported).find("a.glb/images/0"), std::string::npos);
  file.primitive()["attributes"].erase("TEXCOORD_0");
  EXPECT_EQ(place_of_error(file), "a.glb/meshes/0/primitives/0/material");
}

TEST(Gltf, VariantsAreChosenByName) {
  GltfBuilder file = triangle();
  file.json["materials"] = {{{"emissiveFactor", {1, 0, 0}}}, {{"emissiveFactor", {0, 1, 0}}}};
  file.json["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "day"}}, {{"name", "night"}}};
  file.primitive()["material"] = 0;
  file.primitive()["extensions"]["KHR_materials_variants"]["mappings"] = {{{"material", 1}, {"variants", {1}}}};
  const auto emission = [&](const std::optional<std::string>& variant) {
    return read(file, {.smooth = {}, .variant = variant, .scene = {}}).materials.at(0).emission;
  };
  EXPECT_EQ(emission(std::nullopt), (Rgb{1, 0, 0}));
  EXPECT_EQ(emission("day"), (Rgb{1, 0, 0}));
  EXPECT_EQ(emission("night"), (Rgb{0, 1, 0}));
  try {
    emission("dawn");
    FAIL();
  } catch (const BrokenFile& broken) {
    EXPECT_EQ(broken.errors.at(0).pointer, "variant");
    EXPECT_EQ(broken.errors.at(0).detail, "There is no variant \"dawn\"; the file has \"day\", \"night\".");
  }
}

TEST(Gltf, RequiredExtensionsMustBeKnown) {
  GltfBuilder file = triangle();
  file.json["extensionsUsed"] = {"KHR_materials_ior", "X_known_to_nobody"};
  EXPECT_EQ(warnings_of(read(file)),
            "a.glb/extensionsUsed: Extensions that aren't known here are ignored: \"X_known_to_nobody\"\n");
  file.json["extensionsRequired"] = {"X_known_to_nobody"};
  EXPECT_EQ(place_of_error(file), "a.glb/extensionsRequired/0");
}

// Lights and cameras.

TEST(Gltf, LightsShineAlongTheirNodesAxis) {
  GltfBuilder file = triangle();
  file.json["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}, {"color", {1, 0.5, 0}}, {"intensity", 20}},
      {{"type", "directional"}, {"intensity", 3}},
      {{"type", "spot"}, {"intensity", 2}, {"spot", {{"innerConeAngle", 0.1}, {"outerConeAngle", 0.2}}}}};
  const double half = std::sqrt(0.5);
  file.json["nodes"] = Json::array();
  for (int light = 0; light < 3; ++light) {
    file.json["nodes"].push_back({{"translation", {1, 2, 3}},
                                  {"rotation", {-half, 0, 0, half}},  // −z to −y
                                  {"scale", {7, 7, 7}},
                                  {"extensions", {{"KHR_lights_punctual", {{"light", light}}}}}});
  }
  file.json["scenes"][0]["nodes"] = {0, 1, 2};
  const Imported imported = read(file);
  ASSERT_EQ(imported.lights.size(), 3U);
  const auto& point = std::get<PointLight>(imported.lights[0]);
  EXPECT_EQ(point.position, (Vec3{1, 2, 3}));
  EXPECT_EQ(point.intensity, (Rgb{20, 10, 0}));
  const auto& sun = std::get<DirectionalLight>(imported.lights[1]);
  EXPECT_NEAR(sun.direction.vec().y, -1, 1e-6);
  EXPECT_EQ(sun.irradiance, (Rgb{3, 3, 3}));
  const auto& spot = std::get<SpotLight>(imported.lights[2]);
  EXPECT_NEAR(spot.direction.vec().y, -1, 1e-6);
  EXPECT_EQ(spot.inner_angle, 0.1F);
  EXPECT_EQ(spot.outer_angle, 0.2F);
}

TEST(Gltf, CamerasLookAlongTheirNodesAxis) {
  GltfBuilder file = triangle();
  file.json["cameras"] = {
      {{"type", "perspective"}, {"name", "eye"}, {"perspective", {{"yfov", 0.8}, {"znear", 0.1}, {"zfar", 50}}}},
      {{"type", "orthographic"}, {"orthographic", {{"xmag", 3}, {"ymag", 2}, {"znear", 0}, {"zfar", 9}}}}};
  file.json["nodes"].push_back({{"camera", 0}, {"translation", {1, 2, 3}}});
  file.json["nodes"].push_back({{"camera", 1}, {"name", "plan"}});
  file.json["scenes"][0]["nodes"] = {0, 1, 2};
  const Imported imported = read(file);
  ASSERT_EQ(imported.cameras.size(), 2U);
  EXPECT_EQ(imported.cameras[0].name, "eye");
  EXPECT_EQ(imported.cameras[1].name, "plan");
  const auto& eye = std::get<PerspectiveCamera>(imported.cameras[0].camera);
  EXPECT_EQ(eye.view.from, (Vec3{1, 2, 3}));
  EXPECT_EQ(eye.view.at - eye.view.from, (Vec3{0, 0, -3}));
  EXPECT_EQ(eye.view.up, (Vec3{0, 1, 0}));
  EXPECT_EQ(eye.vertical_fov, 0.8F);
  EXPECT_EQ(eye.clipping.near, 0.1F);
  EXPECT_EQ(eye.clipping.far, 50);
  EXPECT_EQ(std::get<OrthographicCamera>(imported.cameras[1].camera).height, 4);
}

}  // namespace
}  // namespace tessera::proto
