#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "proto/import/import.h"
#include "tests/support/import_checks.h"
#include "tests/support/shared_data_test.h"

namespace tessera::proto {
namespace {

namespace fs = std::filesystem;

Result<Imported> import_gltf_file(const fs::path& path) {
  return import_file(path, FileFormat::gltf, path.filename().string(),
                     [&](std::string_view name) -> std::optional<fs::path> {
                       const fs::path companion = path.parent_path() / name;
                       return fs::is_regular_file(companion) ? std::optional(companion) : std::nullopt;
                     });
}

std::string errors_of(const Result<Imported>& result) {
  if (result) return "";
  std::string text = result.problem().detail;
  for (const FieldError& error : result.problem().errors) text += "\n  " + error.pointer + ": " + error.detail;
  return text;
}

std::size_t triangles_of(const Imported& imported) {
  std::size_t triangles = 0;
  for (const ImportedPart& part : imported.parts) triangles += std::get<TriangleMesh>(part.shape).triangles.size();
  return triangles;
}

using GltfFiles = SharedDataTest;

TEST_F(GltfFiles, ModelsHaveTheTrianglesThatTheyWereCountedToHave) {
  const std::map<std::string, std::string> refused{
      {"MissingBin/BoxTextured.gltf", "BoxTextured.gltf/buffers/0/uri"},
      {"IndexOutOfRange/IndexOutOfRange.gltf", "IndexOutOfRange.gltf/accessors/0"},
      {"IndexOutOfRange/AllIndicesOutOfRange.gltf", "AllIndicesOutOfRange.gltf/accessors/0"},
      {"wrongTypes/badArray.gltf", "badArray.gltf/meshes/0/primitives"},
      {"wrongTypes/badExtension.gltf",
       "badExtension.gltf/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform"},
      {"wrongTypes/badNumber.gltf", "badNumber.gltf/materials/0/normalTexture/scale"},
      {"wrongTypes/badObject.gltf", "badObject.gltf/materials/0/pbrMetallicRoughness"},
      {"wrongTypes/badString.gltf", "badString.gltf/scenes/0/name"},
      {"wrongTypes/badUint.gltf", "badUint.gltf/materials/0/pbrMetallicRoughness/baseColorTexture/index"},
      // One node with four parents, which glTF forbids.
      {"CubeScaledInstances/glTF/cube_att.gltf", "cube_att.gltf/nodes/2/children/0"},
  };
  // These have strips and fans beside the triangles that are counted, or show a mesh twice, which is one part here.
  const std::map<std::string, std::size_t> others{
      {"UnlitTest/glTF/UnlitTest.gltf", 44},
      {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_04.gltf", 2},
      {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_05.gltf", 2},
      {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_11.gltf", 2},
      {"glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_12.gltf", 2},
  };
  const auto manifest = nlohmann::json::parse(std::ifstream(data_ / "gltf/manifest.json"));
  for (const auto& [name, facts] : manifest.items()) {
    SCOPED_TRACE(name);
    const Result<Imported> result = import_gltf_file(data_ / "gltf" / name);
    if (const auto pointer = refused.find(name); pointer != refused.end()) {
      ASSERT_FALSE(result);
      EXPECT_EQ(result.problem().errors.front().pointer, pointer->second);
      continue;
    }
    ASSERT_TRUE(result) << errors_of(result);
    const auto other = others.find(name);
    EXPECT_EQ(triangles_of(*result),
              other == others.end() ? facts["mode4_tris_unique"].get<std::size_t>() : other->second);
    const std::string fault =
        result->parts.empty() ? "" : fault_of_import(*result, fs::file_size(data_ / "gltf" / name) * 4096);
    EXPECT_EQ(fault, "");
  }
}

TEST_F(GltfFiles, WhatTheSpecificationForbidsIsRefusedWithItsPlace) {
  const std::map<std::string, std::string> not_imported{
      {"UNDECLARED_EXTENSION", "an extension that isn't known is told and ignored, declared or not"},
  };
  const std::map<std::string, std::string> accepted_here{
      {"zero_bytelength.gltf", "a view of nothing holds nothing that is imported, and models in use have them"},
  };
  const std::map<std::string, std::string> refused_here{
      {"non_relative_uri.gltf", "nothing is fetched from the network"},
  };
  std::size_t refused = 0, accepted = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(data_ / "gltf-validator/base")) {
    constexpr std::string_view kReport = ".report.json";
    const std::string report_name = entry.path().string();
    if (!report_name.ends_with(kReport)) continue;
    const fs::path path = report_name.substr(0, report_name.size() - kReport.size());
    const std::string name = path.filename().string();
    SCOPED_TRACE(path);
    std::set<std::string> places;
    const auto report = nlohmann::json::parse(std::ifstream(entry.path()));
    for (const auto& message : report["issues"]["messages"]) {
      if (message["severity"] != 0 || not_imported.contains(message["code"])) continue;
      const std::string pointer = message.value("pointer", "");
      places.insert(name + (pointer == "/" ? "" : pointer));
    }
    const Result<Imported> result = import_gltf_file(path);
    const bool is_to_be_refused =
        (!places.empty() && !(accepted_here.contains(name) && path.parent_path().filename() == "buffer_view")) ||
        refused_here.contains(name);
    EXPECT_EQ(!result, is_to_be_refused) << errors_of(result);
    (result ? accepted : refused) += 1;
    if (result || places.empty()) continue;
    const auto& errors = result.problem().errors;
    EXPECT_TRUE(std::ranges::any_of(errors, [&](const FieldError& e) { return places.contains(e.pointer); }))
        << errors_of(result);
  }
  EXPECT_EQ(refused + accepted, 131U);
}

}  // namespace
}  // namespace tessera::proto
