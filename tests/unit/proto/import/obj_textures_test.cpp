#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "core/material/texture_lookup.h"
#include "proto/import/broken_file.h"
#include "proto/import/import.h"
#include "proto/import/obj.h"
#include "proto/wire/material_textures.h"
#include "tests/support/png_bytes.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace tessera::proto {
namespace {

namespace fs = std::filesystem;

const std::string kTextured = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nmtllib m.mtl\nusemtl m\n";

/// A folder with libraries and images: red.png, half.png (RGBA, alpha 128), and two.png, black beside white.
class ObjTextures : public FolderTest {
 protected:
  ObjTextures() {
    write("red.png", png_bytes(3, {255, 0, 0}));
    write("half.png", png_bytes(4, {10, 20, 30, 128}));
    write("two.png", png_bytes(3, {0, 0, 0, 255, 255, 255}));
  }

  Imported read(const std::string& obj) {
    return import_obj(obj, "a.obj", [&](std::string_view name) -> std::optional<fs::path> {
      asked_.emplace_back(name);
      std::error_code error;
      return fs::is_regular_file(folder_ / name, error) ? std::optional(folder_ / name) : std::nullopt;
    });
  }

  Imported read_with(const std::string& mtl) {
    write("m.mtl", "newmtl m\n" + mtl);
    return read(kTextured + "f 1/1 2/2 3/3\n");
  }

  Material material(const std::string& mtl) {
    file_ = read_with(mtl);
    return file_.materials.at(file_.parts.at(0).material.value());
  }

  std::vector<std::string> told() const {
    std::vector<std::string> told;
    for (const SceneWarning& warning : file_.warnings) told.push_back(warning.pointer + ": " + warning.detail);
    return told;
  }

  Imported file_;  ///< Of the last `material`.
  std::vector<std::string> asked_;
};

const MeshAttributes& attributes(const Imported& file, std::size_t part = 0) {
  return *std::get<TriangleMesh>(file.parts.at(part).shape).attributes;
}

TEST_F(ObjTextures, AreLookedUpWithVGrowingDownwards) {
  const Material m = material("Kd 0.5 0.25 1\nmap_Kd two.png\n");
  EXPECT_TRUE(file_.warnings.empty());
  EXPECT_EQ(attributes(file_).uvs[0], (std::vector<Vec2>{{0, 1}, {1, 1}, {1, 0}}));
  EXPECT_TRUE(attributes(file_).uvs[1].empty());
  EXPECT_TRUE(attributes(file_).colors.empty());
  EXPECT_EQ(std::get<WhittedSurface>(m.surface).diffuse, (Rgb{0.5F, 0.25F, 1}));
  ASSERT_EQ(m.textures.size(), 1U);
  EXPECT_EQ(m.textures[0].slot, TextureSlot::base_color);
  ASSERT_EQ(file_.textures.size(), 1U);
  EXPECT_TRUE(file_.textures[0].is_srgb);
  EXPECT_EQ(file_.textures[0].wrap_u, Wrap::repeat);
  EXPECT_EQ(look_up(file_.textures[0], {0.25F, 0.5F})[0], 0);
  EXPECT_EQ(look_up(file_.textures[0], {0.75F, 0.5F})[0], 1);
}

TEST_F(ObjTextures, MakeAVertexOfEachCombination) {
  write("m.mtl", "newmtl m\nmap_Kd red.png\nnewmtl plain\n");
  const std::string faces = "f 1/1 2/2 3/3\nf 1/1 2/2 3/1\nf 1/1 2 3/9\nusemtl plain\nf 1/1 2/2 3/3\nf 1/2 2/1 3/3\n";
  const Imported file = read(kTextured + faces);
  EXPECT_EQ(attributes(file).uvs[0], (std::vector<Vec2>{{0, 1}, {1, 1}, {1, 0}, {0, 1}, {0, 0}, {0, 0}}));
  EXPECT_EQ(std::get<TriangleMesh>(file.parts.at(1).shape).attributes, nullptr) << "nothing is looked up there";
  EXPECT_EQ(std::get<TriangleMesh>(file.parts.at(1).shape).positions.size(), 3U);
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_TRUE(file.warnings[0].detail.starts_with("The index of a normal or a texture coordinate that isn't there"));
}

TEST_F(ObjTextures, CoordinatesInEveryForm) {
  write("m.mtl", "newmtl m\nmap_Kd red.png\n");
  const Imported file =
      read("vt 0.5\nvt 2 -3 7\nvt nan 0\nv 0 0 0\nv 1 0 0\nv 1 1 0\nmtllib m.mtl\nusemtl m\nf 1/-3 2/-2 3/-1\n");
  EXPECT_EQ(attributes(file).uvs[0], (std::vector<Vec2>{{0.5F, 1}, {2, 4}, {0, 1}}));
  ASSERT_EQ(file.warnings.size(), 1U);
  EXPECT_EQ(file.warnings[0].pointer, "a.obj:3");
  const Imported without = read(kTextured + "f 1 2 3\n");
  ASSERT_EQ(without.warnings.size(), 1U);
  EXPECT_EQ(without.warnings[0].detail, "Faces whose material has textures have no texture coordinates");
}

TEST_F(ObjTextures, EverySlot) {
  const Material m = material(
      "map_Kd red.png\nmap_Ke red.png\nmap_d half.png\nnorm -bm 2 red.png\nbump -bm 0.25 two.png\nmap_Pr two.png\n"
      "map_Pm -imfchan g two.png\nmap_Ps red.png\nmap_Pc two.png\nmap_Pcr two.png\n");
  EXPECT_TRUE(file_.warnings.empty());
  const auto use = [&](TextureSlot slot) {
    const auto found = std::ranges::find(m.textures, slot, &TextureUse::slot);
    return found == m.textures.end() ? TextureUse{} : *found;
  };
  EXPECT_EQ(m.textures.size(), 10U);
  EXPECT_EQ(use(TextureSlot::alpha).channel, 3) << "it has alpha";
  EXPECT_EQ(use(TextureSlot::metallic).channel, 1);
  EXPECT_EQ(use(TextureSlot::roughness).channel, 0);
  EXPECT_EQ(use(TextureSlot::normal).scale, 2);
  EXPECT_EQ(use(TextureSlot::bump).scale, 0.25F);
  const auto is_srgb = [&](TextureSlot slot) { return file_.textures.at(use(slot).texture).is_srgb; };
  EXPECT_TRUE(is_srgb(TextureSlot::base_color));
  EXPECT_TRUE(is_srgb(TextureSlot::emission));
  for (const TextureSlot slot : {TextureSlot::alpha, TextureSlot::normal, TextureSlot::bump, TextureSlot::roughness,
                                 TextureSlot::metallic, TextureSlot::sheen_color, TextureSlot::clearcoat})
    EXPECT_FALSE(is_srgb(slot));
  EXPECT_EQ(file_.textures.size(), 4U) << "red as colour and as numbers, half, two";
  EXPECT_EQ(file_.textures[0].image, file_.textures[2].image) << "opened once";

  EXPECT_EQ(m.emission, (Rgb{1, 1, 1}));
  const auto& layered = std::get<Layered>(m.surface);
  EXPECT_EQ(layered.base_color, (Rgb{1, 1, 1}));
  EXPECT_EQ(layered.metallic, 1);
  EXPECT_EQ(layered.roughness, 1);
  EXPECT_EQ(layered.clearcoat, 1);
  EXPECT_EQ(layered.clearcoat_roughness, 1);
  EXPECT_EQ(layered.sheen_color, (Rgb{1, 1, 1}));
}

TEST_F(ObjTextures, HighlightsHaveTheirs) {
  const auto slots = [](const Material& m) {
    std::vector<TextureSlot> found;
    for (const TextureUse& use : m.textures) found.push_back(use.slot);
    return found;
  };
  const std::vector<TextureSlot> one{TextureSlot::specular_color};
  Material m = material("Ks 0.5 0.25 1\nillum 3\nmap_Ks red.png\n");
  EXPECT_TRUE(file_.warnings.empty());
  EXPECT_EQ(slots(m), one);
  EXPECT_TRUE(file_.textures.at(0).is_srgb);
  EXPECT_EQ(std::get<WhittedSurface>(m.surface).specular, (Rgb{0.5F, 0.25F, 1}));
  m = material("map_Ks red.png\n");
  EXPECT_EQ(slots(m), one);
  EXPECT_EQ(std::get<WhittedSurface>(m.surface).specular, (Rgb{1, 1, 1}));
  for (const char* without : {"Ks 0 0 0\n", "Ks 1 1 1\nillum 1\n", "Ks 1 1 1\nPm 0\n"}) {
    EXPECT_TRUE(slots(material(std::string(without) + "map_Ks red.png\n")).empty()) << without;
    ASSERT_EQ(file_.warnings.size(), 1U) << without;
    EXPECT_NE(file_.warnings[0].detail.find("map_Ks has no effect"), std::string::npos);
  }
}

TEST_F(ObjTextures, AlphaIsTheImagesWhereItHasSome) {
  EXPECT_EQ(material("map_d half.png\n").textures.at(0).channel, 3);
  EXPECT_EQ(material("map_d two.png\n").textures.at(0).channel, 0);
  EXPECT_EQ(material("map_d -imfchan l half.png\n").textures.at(0).channel, 0);
  EXPECT_EQ(material("map_d -imfchan m two.png\n").textures.at(0).channel, 3);
  const Material m = material("Kd 1 1 1\nd 0.5\nmap_d half.png\n");
  EXPECT_EQ(m.alpha, 0.5F);
  EXPECT_EQ(std::get<WhittedSurface>(m.surface).diffuse, (Rgb{1, 1, 1}));
  EXPECT_TRUE(std::get<WhittedSurface>(m.surface).transmit.is_black()) << "what alpha lets pass passes once";
  EXPECT_EQ(material("d 0\nmap_d half.png\n").alpha, 1) << "as many programs write it";
  EXPECT_EQ(material("d 0.5\n").alpha, 1);
}

TEST_F(ObjTextures, OptionsMoveAndScale) {
  material("map_Kd -s 2 4 1 -o 0.5 0.25 0 -clamp on two.png\n");
  EXPECT_TRUE(file_.warnings.empty());
  const Texture& texture = file_.textures.at(0);
  EXPECT_EQ(texture.wrap_u, Wrap::clamp);
  EXPECT_EQ(texture.wrap_v, Wrap::clamp);
  // MTL: (2 u + 0.5, 4 v + 0.25), with v upwards. Of (0.1, 0.1): (0.7, 0.65), downwards (0.7, 0.35).
  const auto& t = texture.transform;
  const float u = 0.1F, v = 1 - 0.1F;
  EXPECT_FLOAT_EQ(t[0] * u + t[1] * v + t[2], 0.7F);
  EXPECT_FLOAT_EQ(t[3] * u + t[4] * v + t[5], 0.35F);
  material("map_Kd -s 2 -o -1 two.png\n");
  EXPECT_EQ(file_.textures.at(0).transform, (std::array<float, 6>{2, 0, -1, 0, 1, 0})) << "what isn't said stays";

  material("map_Kd -blendu on -blendv on -cc off -mm 0 1 -t 0 0 0 -texres 512 -o 0 0 0 -s 1 1 1 -clamp off red.png\n");
  EXPECT_TRUE(file_.warnings.empty()) << "as it is done anyway";
  EXPECT_EQ(file_.textures.at(0).transform, (std::array<float, 6>{1, 0, 0, 0, 1, 0}));
  for (const char* option : {"-blendu off", "-boost 2", "-cc on", "-mm 0.1 1", "-t 1", "-type sphere", "-imfchan x"}) {
    material(std::string("map_Kd ") + option + " red.png\n");
    ASSERT_EQ(file_.warnings.size(), 1U) << option;
    EXPECT_TRUE(file_.warnings[0].detail.starts_with("An option of a texture other than")) << option;
    EXPECT_EQ(file_.textures.size(), 1U) << option;
  }
  material("bump red.png -imfchan g -bm 1.5\n");
  EXPECT_TRUE(file_.warnings.empty()) << "options may follow the name";
  EXPECT_EQ(file_.materials[0].textures.at(0).channel, 1);
  EXPECT_EQ(file_.materials[0].textures.at(0).scale, 1.5F);
  material("map_Kd -colorspace linear red.png\nmap_Pr -colorspace sRGB two.png\n");
  EXPECT_FALSE(file_.textures.at(0).is_srgb);
  EXPECT_TRUE(file_.textures.at(1).is_srgb);
  material("bump -bm red.png\n");
  EXPECT_EQ(told().at(0), "m.mtl:2: An option of a texture without its value was ignored");
  EXPECT_EQ(file_.materials[0].textures.at(0).scale, 1);
  material("bump -bm 1e9 red.png\n");
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_EQ(told().at(0), "m.mtl:2: A number of a texture that isn't one, or is beyond a million, counts as 0");
}

TEST_F(ObjTextures, NamesInEveryForm) {
  for (const char* name : {"a b.png", "sub/a.png", "1.png", "#1.png", "a #2.png", "-x.png"})
    write(name, png_bytes(3, {1, 2, 3}));
  for (const char* written : {"a b.png", "\"a b.png\"", "a\\ b.png", "sub\\a.png", ".\\sub\\a.png", "1.png", "#1.png",
                              "a #2.png", "red.png # red", "-x.png", "C:\\Users\\bob smith\\red.png", "/x/y/red.png",
                              "../elsewhere/red.png", "-s 1 1 1.png", "./red.png \t", "sub/../red.png"}) {
    material(std::string("map_Kd ") + written + "\n");
    EXPECT_TRUE(file_.warnings.empty()) << written;
    EXPECT_EQ(file_.textures.size(), 1U) << written;
  }
}

TEST_F(ObjTextures, AreBesideTheLibraryThatNamesThem) {
  write("lib/m.mtl", "newmtl m\nmap_Kd ../red.png\nnewmtl n\nmap_Kd own.png\nnewmtl o\nmap_Kd two.png\n");
  write("lib/own.png", png_bytes(3, {1, 1, 1}));
  const Imported file = read(
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nmtllib lib/m.mtl\nusemtl m\nf 1/1 2/1 3/1\nusemtl n\n"
      "f 1/1 2/1 3/1\nusemtl o\nf 1/1 2/1 3/1\n");
  EXPECT_TRUE(file.warnings.empty());
  EXPECT_EQ(file.textures.size(), 3U);
  EXPECT_EQ(asked_, (std::vector<std::string>{"lib/m.mtl", "red.png", "lib/own.png", "lib/two.png", "two.png"}));
}

TEST_F(ObjTextures, WhatIsMissingOrBrokenIsToldAndWhite) {
  write("broken.png", "no image");
  const Material m = material("Kd 0.5 0.5 0.5\nmap_Kd gone.png\nmap_Ke broken.png\nKe 2 2 2\nmap_d gone.png\n");
  EXPECT_EQ(told(),
            (std::vector<std::string>{
                "m.mtl:3: The texture \"gone.png\" isn't there (2 times)",
                "m.mtl:4: The texture \"broken.png\" can't be used: It is no image of a kind that is known here "
                "(PNG, JPEG, WebP, EXR, HDR, TIFF, BMP, Targa)"}));
  EXPECT_TRUE(m.textures.empty());
  EXPECT_EQ(std::get<WhittedSurface>(m.surface).diffuse, (Rgb{0.5F, 0.5F, 0.5F}));
  EXPECT_EQ(m.emission, (Rgb{2, 2, 2}));
  EXPECT_FALSE(std::get<WhittedSurface>(material("map_Kd gone.png\n").surface).diffuse.is_black());
  EXPECT_EQ(std::get<WhittedSurface>(material("Kd 0 0 0\nmap_Kd red.png\n").surface).diffuse, (Rgb{1, 1, 1}))
      << "black times a texture would be black";

  std::string many;
  for (int i = 0; i < 100; ++i) many += "map_Kd gone" + std::to_string(i) + ".png\n";
  material(many);
  EXPECT_EQ(file_.warnings.size(), 21U);
  EXPECT_TRUE(file_.warnings.back().detail.ends_with("(80 times)"));
}

TEST_F(ObjTextures, OnlyThoseOfMaterialsThatAreSeenAreOpened) {
  write("m.mtl", "newmtl m\nmap_Kd red.png\nnewmtl n\nmap_Kd broken.png\n");
  write("broken.png", "no image");
  const Imported file = read(kTextured + "f 1/1 2/2 3/3\n");
  EXPECT_TRUE(file.warnings.empty());
  EXPECT_EQ(file.textures.size(), 1U);
}

TEST_F(ObjTextures, ImagesThatAreTooLargeAreTold) {
  std::string huge = png_bytes(3, {1, 2, 3});
  huge[16] = huge[20] = '\x7F';  // the header's width and height
  write("huge.png", huge);
  EXPECT_TRUE(material("map_Kd huge.png\n").textures.empty());
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_NE(file_.warnings[0].detail.find("take more memory than there may be"), std::string::npos);
}

TEST_F(ObjTextures, MapsOfNormalsThatAreCalledBumps) {
  for (const char* name : {"brick_Normal.png", "nrm.png", "rock_nor_gl_1k.png"}) {
    write(name, png_bytes(3, {128, 128, 255}));
    EXPECT_EQ(material(std::string("map_Bump -bm 1 ") + name + "\n").textures.at(0).slot, TextureSlot::normal) << name;
    EXPECT_EQ(told().at(0), "m.mtl:2: A bump map whose name says that it holds normals is read as such");
  }
  EXPECT_EQ(material("map_Bump red.png\n").textures.at(0).slot, TextureSlot::bump);
}

TEST_F(ObjTextures, EmissionIsRadianceOfBothSides) {
  const Material m = material("Ke 17 12 4\n");
  EXPECT_TRUE(file_.warnings.empty());
  EXPECT_EQ(m.emission, (Rgb{17, 12, 4}));
  EXPECT_TRUE(m.emits_both_sides);
  EXPECT_TRUE(material("Ke 0 0 0\nke 0.0\n").emission.is_black());
  EXPECT_FALSE(file_.materials[0].emits_both_sides);
}

TEST_F(ObjTextures, ThePhysicallyBasedExtension) {
  const auto plain = std::get<MetallicRoughness>(material("Kd 0.1 0.2 0.3\nPr 0.25\nPm 0.75\n").surface);
  EXPECT_EQ(plain.base_color, (Rgb{0.1F, 0.2F, 0.3F}));
  EXPECT_EQ(plain.roughness, 0.25F);
  EXPECT_EQ(plain.metallic, 0.75F);
  EXPECT_TRUE(file_.warnings.empty());
  EXPECT_EQ(std::get<MetallicRoughness>(material("Pr 0.5\n").surface).metallic, 0);
  EXPECT_EQ(std::get<MetallicRoughness>(material("Pr 0\nPm 0\nmap_Pr two.png\nmap_Pm two.png\n").surface).roughness, 1);
  // Phong's exponent 30 is α = 1/4 (Walter et al. 2007), of a roughness of 1/2.
  EXPECT_FLOAT_EQ(std::get<MetallicRoughness>(material("Pm 1\nNs 30\n").surface).roughness, 0.5F);
  const auto coated = std::get<Layered>(material("Pr 0.5\nPc 0.75\nPcr 0.25\n").surface);
  EXPECT_EQ(coated.clearcoat, 0.75F);
  EXPECT_EQ(coated.clearcoat_roughness, 0.25F);
  EXPECT_TRUE(coated.sheen_color.is_black());
  EXPECT_EQ(std::get<Layered>(material("Ps 0.5\n").surface).sheen_color, (Rgb{0.5F, 0.5F, 0.5F}));
  EXPECT_EQ(material("Pr 1\nd 0.25\n").alpha, 0.25F);
  const auto glass = std::get<Layered>(material("Pr 0\nillum 7\nTf 1 1 1\nNi 1.45\n").surface);
  EXPECT_EQ(glass.transmission, 1);
  EXPECT_EQ(glass.ior, 1.45F);
  EXPECT_FALSE(glass.thin);
}

TEST_F(ObjTextures, ColoursOfVertices) {
  write("m.mtl", "newmtl m\nKd 0.5 0.5 0.5\n");
  const std::string vertices =
      "mtllib m.mtl\nv 0 0 0 1 0.5 0\nv 1 0 0\nv 1 1 0 0 0.0404 1\nv 0 1 0\nv 0 2 0\nv 0 3 0\n";
  const Imported file = read(vertices + "f 1 2 3\nusemtl m\nf 1 2 3\no b\nf 2 4 5\no c\nf 3 4 5\n");
  EXPECT_TRUE(file.warnings.empty());
  const auto& colors = attributes(file).colors;
  ASSERT_EQ(colors.size(), 3U);
  EXPECT_EQ(colors[0][0], 1);
  EXPECT_NEAR(colors[0][1], std::pow((0.5 + 0.055) / 1.055, 2.4), 1e-6) << "sRGB";
  EXPECT_EQ(colors[1], (std::array<float, 4>{1, 1, 1, 1})) << "without one";
  EXPECT_NEAR(colors[2][1], 0.0404 / 12.92, 1e-6);
  const Material& bare = file.materials.at(file.parts.at(0).material.value());
  EXPECT_EQ(std::get<Diffuse>(bare.surface).color, (Rgb{1, 1, 1}));
  EXPECT_TRUE(bare.has_vertex_colors);
  EXPECT_FALSE(bare.has_vertex_alpha);
  const Material& tinted = file.materials.at(file.parts.at(1).material.value());
  EXPECT_EQ(std::get<WhittedSurface>(tinted.surface).diffuse, (Rgb{0.5F, 0.5F, 0.5F}));
  EXPECT_TRUE(tinted.has_vertex_colors);
  EXPECT_FALSE(file.materials.at(file.parts.at(2).material.value()).has_vertex_colors) << "all white";
  EXPECT_EQ(file.parts.at(1).material, file.parts.at(3).material);

  const Imported bytes = read("v 0 0 0 255 0 51\nv 1 0 0 0 0 0\nv 1 1 0\nf 1 2 3\n");
  EXPECT_EQ(attributes(bytes).colors[0][0], 1);
  EXPECT_NEAR(attributes(bytes).colors[0][2], std::pow((0.2 + 0.055) / 1.055, 2.4), 1e-6);
  EXPECT_EQ(attributes(bytes).colors[2][0], 1);
  ASSERT_EQ(bytes.warnings.size(), 1U);
  const Imported weight = read("v 0 0 0 2\nv 1 0 0 1 1\nv 1 1 0 1 1 1 1\nf 1 2 3\n");
  EXPECT_EQ(std::get<TriangleMesh>(weight.parts[0].shape).attributes, nullptr);
  EXPECT_EQ(weight.warnings.size(), 2U);
}

TEST_F(ObjTextures, SpotHasItsTexture) {
  const auto data = shared_data();
  if (!data) GTEST_SKIP() << "the shared data is missing: set TESSERA_SHARED_DATA";
  fs::copy(*data / "meshes/spot_texture.png", folder_);
  write("spot.mtl", "newmtl cow\nmap_Kd spot_texture.png\n");
  std::ifstream spot(*data / "meshes/spot.obj");
  const std::string obj{std::istreambuf_iterator<char>(spot), {}};
  const Imported file = read("mtllib spot.mtl\nusemtl cow\n" + obj);
  EXPECT_TRUE(file.warnings.empty());
  ASSERT_EQ(file.parts.size(), 1U);
  const auto& mesh = std::get<TriangleMesh>(file.parts[0].shape);
  ASSERT_EQ(mesh.attributes->uvs[0].size(), mesh.positions.size());
  // The cow's eyes are black and her body is white: without seams between them, neither is all of her.
  double least = 1, most = 0;
  for (const Vec2 uv : mesh.attributes->uvs[0]) {
    const double light = look_up(file.textures.at(0), uv)[1];
    least = std::min(least, light);
    most = std::max(most, light);
  }
  EXPECT_LT(least, 0.1);
  EXPECT_GT(most, 0.8);
}

/// Whoever sends a library with its textures finds them by the scanner; the reader has lines of its own.
TEST_F(ObjTextures, ReaderAndScannerSeeTheSameStatements) {
  constexpr std::string_view kPieces[] = {"map_Kd", "Bump", " ",     "\t",        "\\",   "\n",   "\r",
                                          "\r\n",   "#",    "a.png", "\"",        "-s 1", "map_", "-bm",
                                          "map_Pc", "\\\n", "r",     "\nnorm b ", "Kd"};
  for (unsigned seed = 0; seed < 1000; ++seed) {
    std::mt19937 random(seed);
    std::string text = "newmtl m\n";
    for (int i = 0; i < 24; ++i) text += kPieces[random() % std::size(kPieces)];
    write("m.mtl", text);
    asked_.clear();
    read("mtllib m.mtl\n");
    std::vector<std::string> scanned{"m.mtl"};
    TextureSearch search([&](const std::string& name) {
      scanned.push_back(name);
      return fs::is_regular_file(folder_ / name);
    });
    StatementScanner scanner(kTextureKeywords, [&](std::string_view, std::string_view arguments) {
      search.look_for("m.mtl", split_texture_statement(arguments).file);
    });
    for (std::size_t at = 0, size = 0; at < text.size(); at += size) {
      size = 1 + random() % 7;
      scanner.feed(std::string_view(text).substr(at, size));
    }
    scanner.finish();
    EXPECT_EQ(scanned, asked_) << "seed " << seed << '\n' << text;
  }
}

}  // namespace
}  // namespace tessera::proto
