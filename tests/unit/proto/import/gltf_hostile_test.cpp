#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "proto/import/broken_file.h"
#include "proto/import/gltf/accessors.h"
#include "proto/import/gltf/gltf.h"
#include "proto/import/gltf/meshes.h"
#include "proto/import/import_notes.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/png_bytes.h"
#include "tests/unit/proto/test_files.h"

namespace tessera::proto {
namespace {

using Json = nlohmann::json;

/// A file of which parts are read, and the steps that it takes.
struct Opened {
  explicit Opened(GltfBuilder& builder, const CompanionSource& companions = nullptr)
      : bytes(builder.glb()),
        parts(take_apart(bytes, "a.glb")),
        file(parts.json, bytes.size(), "a.glb", companions, {}),
        buffers(file, parts),
        accessors(file, buffers) {}

  template <typename Work>
  std::uint64_t steps_of(const Work& work) {
    const std::uint64_t before = file.steps().taken();
    work();
    return file.steps().taken() - before;
  }

  std::string bytes;
  GltfParts parts;
  GltfFile file;
  GltfBuffers buffers;
  Accessors accessors;
};

CompanionSource companions_in(const TestFiles& files) {
  return [&files](std::string_view name) -> std::optional<std::filesystem::path> {
    const auto file = files.asset(name, {});
    return file ? std::optional(file->path) : std::nullopt;
  };
}

std::string first_error(std::string_view bytes) {
  try {
    import_gltf(bytes, "a.glb", nullptr, {}, 1 << 24);
  } catch (const BrokenFile& broken) {
    return broken.errors.front().pointer;
  }
  return "none";
}

TEST(HostileGltf, TargetsOfManyAttributesAreCheckedInLinearTime) {
  const auto steps = [](int count) {
    GltfBuilder file;
    file.add_triangle();
    for (int i = 0; i < count; ++i) {
      const std::string name = "_" + std::to_string(i);
      file.primitive()["attributes"][name] = 0;
      file.primitive()["targets"][0][name] = 0;
    }
    Opened opened(file);
    return opened.steps_of([&] { read_meshes(opened.file, opened.buffers, opened.accessors, {}, {}); });
  };
  EXPECT_LT(steps(2000), 5 * steps(500));
}

TEST(HostileGltf, OfASparseAccessorAFewElementsCostAsMuchAsTheyAreFew) {
  const auto steps = [](std::uint32_t count) {
    GltfBuilder file;
    file.add_triangle();
    std::vector<std::uint32_t> indices;
    for (std::uint32_t i = 0; i < count; ++i) indices.push_back(2 * i);
    const std::vector<float> values(std::size_t{3} * count, 7);
    const auto view = [&](const auto& of) {
      return file.add_view({reinterpret_cast<const char*>(of.data()), of.size() * 4});
    };
    file.json["accessors"][0] = {
        {"count", 2 * count},
        {"componentType", GltfBuilder::kFloat},
        {"type", "VEC3"},
        {"sparse",
         {{"count", count},
          {"indices", {{"bufferView", view(indices)}, {"componentType", GltfBuilder::kUint32}}},
          {"values", {{"bufferView", view(values)}}}}}};
    Opened opened(file);
    const std::vector<std::uint32_t> which{0, 1, 2 * count - 2};
    const auto read = [&] {
      EXPECT_EQ(opened.accessors.read<Vec3>(0, which), (std::vector<Vec3>{{7, 7, 7}, {0, 0, 0}, {7, 7, 7}}));
    };
    EXPECT_GE(opened.steps_of(read), count) << "which looks at all indices once";
    return opened.steps_of(read);
  };
  EXPECT_LE(steps(4000), steps(1000) + 10);
}

TEST(HostileGltf, OfNotesWithoutEndTheFirstKindsAreTold) {
  ImportNotes notes("a");
  constexpr std::uint64_t kKinds = 10'000;
  for (int round = 0; round < 2; ++round)
    for (std::uint64_t i = 0; i < kKinds; ++i) notes.add("Kind " + std::to_string(i), i);
  const auto warnings = notes.warnings();
  ASSERT_EQ(warnings.size(), ImportNotes::kMostKinds + 1);
  EXPECT_EQ(warnings[ImportNotes::kMostKinds - 1].detail, "Kind 99 (2 times)");
  EXPECT_EQ(warnings.back().pointer, "a:100");
  EXPECT_EQ(warnings.back().detail, "Other things are ignored or lost, too (19800 times)");
}

TEST(HostileGltf, OfDracosAttributesThoseThatAreReadAreKept) {
  GltfBuilder file;
  file.add_triangle();
  Json ids{{"POSITION", 7}};
  for (int i = 0; i < 1000; ++i) ids["_" + std::to_string(i)] = i;
  file.primitive()["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", file.add_view("DRACO")},
                                                                  {"attributes", ids}};
  Opened opened(file);
  const auto meshes = read_meshes(opened.file, opened.buffers, opened.accessors, {}, {});
  EXPECT_EQ(meshes[0].primitives[0].draco->ids, (decltype(DracoPrimitive::ids){{"POSITION", 7}}));
}

TEST(HostileGltf, JointsOfManyNodesTakeNoMoreMemoryThanAFileMay) {
  GltfBuilder file;
  file.add_triangle();
  file.primitive()["attributes"]["JOINTS_0"] =
      file.add_accessor(std::vector<std::uint8_t>(12), "VEC4", GltfBuilder::kUint8, 4);
  file.primitive()["attributes"]["WEIGHTS_0"] = file.add_floats({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, 4);
  constexpr int kNodes = 2000;
  file.json["skins"][0]["joints"] = std::vector<int>(20'000, 0);
  for (int i = 1; i <= kNodes; ++i) {
    file.json["nodes"][i] = {{"mesh", 0}, {"skin", 0}};
    file.json["scenes"][0]["nodes"].push_back(i);
  }
  EXPECT_EQ(first_error(file.glb()).substr(0, 12), "a.glb/nodes/");
}

TEST(HostileGltf, PrimitivesThatArentShownCountAsOftenAsNodesNameThem) {
  GltfBuilder file;
  file.add_triangle();
  file.primitive()["mode"] = 0;
  for (int i = 1; i < 3000; ++i) file.json["meshes"][0]["primitives"].push_back(file.primitive());
  for (int i = 1; i < 3000; ++i) {
    file.json["nodes"].push_back({{"mesh", 0}});
    file.json["scenes"][0]["nodes"].push_back(i);
  }
  EXPECT_EQ(first_error(file.glb()).substr(0, 26), "a.glb/meshes/0/primitives/");
}

TEST(HostileGltf, AFileThatManyBuffersNameIsReadOnce) {
  TestFiles files;
  files.add_asset("a.bin", std::string(1000, 'x'));
  GltfBuilder file;
  for (const char* uri : {"a.bin", "./a.bin", "%61.bin", "b/../a.bin"}) {
    file.json["bufferViews"].push_back({{"buffer", file.json["bufferViews"].size()}, {"byteLength", 1000}});
    file.json["buffers"].push_back({{"byteLength", 1000}, {"uri", uri}});
  }
  Opened opened(file, companions_in(files));
  ASSERT_TRUE(opened.file.errors().empty());
  const JsonCursor where = opened.file.root().value();
  for (std::uint32_t view = 1; view < 4; ++view)
    EXPECT_EQ(opened.buffers.bytes(view, where)->data(), opened.buffers.bytes(0, where)->data());
}

TEST(HostileGltf, AnImageThatManyNameIsOpenedOnce) {
  TestFiles files;
  const std::string png = png_bytes(3, {255, 0, 0});
  files.add_asset("a.png", png);
  GltfBuilder file;
  file.add_triangle();
  file.primitive()["attributes"]["TEXCOORD_0"] = file.add_floats({0, 0, 1, 0, 0, 1}, 2);
  const std::size_t view = file.add_view(png);
  file.json["bufferViews"].push_back(file.json["bufferViews"][view]);
  file.json["images"] = {{{"bufferView", view}, {"mimeType", "image/png"}},
                         {{"bufferView", view}, {"mimeType", "image/png"}},
                         {{"bufferView", view + 1}, {"mimeType", "image/x-foo"}},
                         {{"uri", "a.png"}},
                         {{"uri", "./%61.png"}}};
  for (std::size_t i = 0; i < 5; ++i) {
    file.json["textures"].push_back({{"source", i}});
    file.json["materials"].push_back({{"normalTexture", {{"index", i}}}});
    auto primitive = file.primitive();
    primitive["material"] = i;
    file.json["meshes"][0]["primitives"][i] = primitive;
  }
  const std::string bytes = file.glb();
  const Imported imported = import_gltf(bytes, "a.glb", companions_in(files), {}, 1 << 24);
  ASSERT_EQ(imported.textures.size(), 5U);
  for (const std::size_t other : {1U, 2U}) EXPECT_EQ(imported.textures[other].image, imported.textures[0].image);
  EXPECT_EQ(imported.textures[4].image, imported.textures[3].image);
  EXPECT_EQ(imported.textures[2].name, "a.glb/images/2");
  ASSERT_EQ(imported.warnings.size(), 1U);
  EXPECT_EQ(imported.warnings[0].pointer, "a.glb/images/2");
  EXPECT_EQ(imported.warnings[0].detail, "An image that is told to be \"image/x-foo\" is a PNG image");
}

}  // namespace
}  // namespace tessera::proto
