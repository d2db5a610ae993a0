#include "tests/benchmarks/support/light_scenes.h"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

#include "tests/benchmarks/support/kernel_meshes.h"
#include "tests/benchmarks/support/mesh_files.h"
#include "tests/support/imported_scene.h"
#include "tests/support/meshes.h"
#include "tests/support/random.h"
#include "tests/support/reference_scenes.h"
#include "tests/support/shared_data.h"

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json grey(double value) { return {value, value, value}; }
json diffuse(json color) { return {{"type", "diffuse"}, {"color", std::move(color)}}; }
json lamp(double radiance) {
  json material = diffuse(grey(0));
  material["emission"] = grey(radiance);
  return material;
}
json quad(const std::string& material, const std::array<Vec3, 4>& corners) {
  json points = json::array();
  for (const Vec3 c : corners) points.push_back({c.x, c.y, c.z});
  return {{"type", "quad"}, {"corners", std::move(points)}, {"material", material}};
}
json camera(const std::array<double, 3>& from, const std::array<double, 3>& at, double fov) {
  return {{"type", "perspective"}, {"from", from}, {"at", at}, {"fov", fov}};
}

/// A document that is put together; its meshes go to files called after the scene.
class Builder {
 public:
  Builder(fs::path folder, std::string name) : folder_(std::move(folder)), name_(std::move(name)) {
    fs::create_directories(folder_);
    document_ = {{"materials", json::object()}, {"objects", json::array()}, {"lights", json::array()}};
  }

  Builder& material(const std::string& name, json value) {
    document_["materials"][name] = std::move(value);
    return *this;
  }
  Builder& object(json value) {
    document_["objects"].push_back(std::move(value));
    return *this;
  }
  Builder& mesh(const TriangleMesh& mesh, const std::string& material, const json& transform = nullptr) {
    const std::string file = name_ + '-' + std::to_string(files_++) + ".ply";
    write_ply(mesh, PlyBody::little_endian, folder_ / file);
    object({{"type", "file"}, {"path", file}, {"material", material}});
    if (!transform.is_null()) document_["objects"].back()["transform"] = transform;
    return *this;
  }
  /// False where there is no such file.
  bool mesh_of(const fs::path& file, const std::string& mesh_material, const json& transform = nullptr) {
    const auto scene = imported_scene(file);
    if (!scene) return false;
    for (const Object& part : scene->objects)
      mesh(std::get<TriangleMesh>(scene->shapes[part.shape]), mesh_material, transform);
    return true;
  }
  Builder& light(json value) {
    document_["lights"].push_back(std::move(value));
    return *this;
  }
  Builder& camera(json value) {
    document_["camera"] = std::move(value);
    return *this;
  }

  LightScene scene(std::string what, std::uint32_t max_depth) const {
    return {name_, std::move(what), document_, max_depth, std::nullopt};
  }

 private:
  fs::path folder_;
  std::string name_;
  json document_;
  int files_ = 0;
};

LightScene reference(const fs::path& data, const fs::path& folder, std::string_view name) {
  const fs::path from = data / "scenes-with-refs";
  const ReferenceScene ignis = IgnisReader(from).read(name);
  Builder builder(folder, std::string(name));
  for (const auto& [material_name, material] : ignis.document["materials"].items())
    builder.material(material_name, material);
  for (const json& object : ignis.document["objects"])
    if (!builder.mesh_of(from / object["path"].get<std::string>(), object["material"],
                         object.value("transform", json(nullptr))))
      throw std::runtime_error("a mesh of " + std::string(name) + " is missing");
  for (const json& light : ignis.document["lights"]) builder.light(light);
  builder.camera(ignis.document["camera"]);
  LightScene scene = builder.scene("Mitsuba's reference", ignis.max_depth);
  scene.known = read_pfm(from / "ignis/references" / ("ref-" + std::string(name) + "-4096-half128.pfm"));
  return scene;
}

/// Within a closed surface that emits `1 − albedo` and reflects `albedo`, a path of so many segments sees 1 − albedo
/// to the power of their number, wherever it looks.
LightScene furnace(Builder builder, const json& shapes, double albedo, std::uint32_t max_depth) {
  json surface = diffuse(grey(albedo));
  surface["emission"] = grey(1 - albedo);
  surface["emits"] = "both";
  builder.material("surface", std::move(surface)).camera(camera({0.1, 0.2, 0.4}, {0, 0, -1}, 70));
  for (const json& shape : shapes) builder.object(shape);
  LightScene scene = builder.scene("a closed surface that emits as much as it absorbs", max_depth);
  const auto value = static_cast<float>(1 - std::pow(albedo, max_depth));
  scene.known = FloatImage{kLightSide, kLightSide, std::vector<Rgb>(kLightSide * kLightSide, {value, value, value})};
  return scene;
}

LightScene sphere_furnace(const fs::path& folder) {
  const json sphere = {{"type", "sphere"}, {"center", {0, 0, 0}}, {"radius", 1}, {"material", "surface"}};
  return furnace(Builder(folder, "furnace-sphere"), json::array({sphere}), 0.5, 16);
}

LightScene box_furnace(const fs::path& folder) {
  json sides = json::array();
  const auto side = [&](Vec3 center, Vec3 u, Vec3 v) {
    sides.push_back(quad("surface", {center - u - v, center + u - v, center + u + v, center - u + v}));
  };
  const Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  for (const float s : {-1.0F, 1.0F}) {
    side(x * s, y, z);
    side(y * s, z, x);
    side(z * s, x, y);
  }
  return furnace(Builder(folder, "furnace-box"), sides, 0.8, 48);
}

/// A floor that bends up into a wall, as photographers hang paper.
TriangleMesh backdrop() {
  TriangleMesh mesh;
  constexpr std::uint32_t kRows = 40;
  constexpr float kHalf = 7, kBend = 2.5F, kWall = -3.5F;
  for (std::uint32_t i = 0; i <= kRows; ++i) {
    const double turn = 1.5707963 * std::clamp((static_cast<double>(i) - 1) / (kRows - 2), 0.0, 1.0);
    Vec3 p{0, kBend - kBend * static_cast<float>(std::cos(turn)), kWall - kBend * static_cast<float>(std::sin(turn))};
    if (i == 0) p.z = 8;
    if (i == kRows) p.y = 9;
    for (const float x : {-kHalf, kHalf}) mesh.positions.push_back({x, p.y, p.z});
    if (i == 0) continue;
    const std::uint32_t at = 2 * i;
    mesh.triangles.push_back({at - 2, at - 1, at + 1});
    mesh.triangles.push_back({at - 2, at + 1, at});
  }
  return mesh;
}

json at(double scale, const std::array<double, 3>& translate, double degrees = 0) {
  return {{"scale", scale}, {"rotate", {{"axis", {0, 1, 0}}, {"degrees", degrees}}}, {"translate", translate}};
}

json metallic_roughness(json color, double metallic, double roughness) {
  return {{"type", "metallic_roughness"},
          {"base_color", std::move(color)},
          {"metallic", metallic},
          {"roughness", roughness}};
}

LightScene product(const std::optional<fs::path>& data, const fs::path& folder) {
  Builder builder(folder, "product");
  builder.material("paper", diffuse({0.75, 0.73, 0.7}))
      .material("ceramic", diffuse({0.55, 0.62, 0.7}))
      .material("plastic", metallic_roughness({0.75, 0.16, 0.08}, 0, 0.35))
      .material("copper", metallic_roughness({0.93, 0.62, 0.52}, 1, 0.3))
      .material("key", lamp(14))
      .material("fill", lamp(4));
  builder.mesh(backdrop(), "paper").mesh(smooth_ball(96, 48), "copper", at(0.8, {1.5, 0.8, 0.2}));
  builder.mesh(organic(20'000), "ceramic", at(0.55, {-1.7, 0.62, -0.4}));
  if (!data || !builder.mesh_of(*data / "meshes/spot.obj", "plastic", at(1, {0, 0.73, 0.3}, 205)))
    builder.mesh(organic(6'000), "plastic", at(0.6, {0, 0.7, 0.3}));
  // Soft boxes: quads that face the middle.
  builder.object(quad("key", {{{-2.5F, 2.5F, 4.5F}, {-4.5F, 2.5F, 2.5F}, {-3.5F, 5, 1.5F}, {-1.5F, 5, 3.5F}}}));
  builder.object(quad("fill", {{{5, 1, 1.5F}, {3.5F, 1, 3.5F}, {3, 3.5F, 3}, {4.5F, 3.5F, 1}}}));
  builder.camera(camera({0, 2.2, 7.5}, {0, 0.85, 0}, 36));
  return builder.scene("three things on paper under two soft boxes", 8);
}

/// What LuxCore's scene file says: `scene.materials.desktop.kd = 0.75 0.70 0.58`, key by key.
class LuxCoreFile {
 public:
  explicit LuxCoreFile(const fs::path& path) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);)
      if (const auto equals = line.find(" = "); line.starts_with("scene.") && equals != std::string::npos)
        values_[line.substr(0, equals)] = line.substr(equals + 3);
  }

  std::string text(const std::string& key) const {
    const auto at = values_.find(key);
    return at == values_.end() ? "" : at->second;
  }
  std::vector<double> numbers(const std::string& key) const {
    std::istringstream words(text(key));
    std::vector<double> numbers;
    for (double number; words >> number;) numbers.push_back(number);
    return numbers;
  }
  /// Names under `scene.objects.`
  std::vector<std::string> objects() const {
    std::vector<std::string> names;
    for (const auto& [key, value] : values_)
      if (key.starts_with("scene.objects.") && key.ends_with(".ply")) names.push_back(key.substr(14, key.size() - 18));
    return names;
  }

  /// A mixture of half a mirror and half a matt surface is a surface that does half of both.
  json material(const std::string& name) const {
    const std::string key = "scene.materials." + name + '.';
    if (text(key + "type") == "mix") {
      json surface = {{"type", "whitted"}};
      for (const char* part : {"material1", "material2"}) {
        const std::string of = "scene.materials." + text(key + part) + '.';
        const bool is_mirror = text(of + "type") == "mirror";
        std::vector<double> color = numbers(of + (is_mirror ? "kr" : "kd"));
        for (double& c : color) c *= 0.5;
        surface[is_mirror ? "reflect" : "diffuse"] = color;
      }
      return surface;
    }
    const auto emission = numbers(key + "emission");
    if (emission.empty()) return diffuse(numbers(key + "kd"));
    json material = diffuse(grey(0));
    material["emission"] = emission;
    return material;
  }

 private:
  std::map<std::string, std::string> values_;
};

/// LuxCore's kitchen as its own scene file has it: daylight comes by a portal, a window that emits.
std::optional<LightScene> kitchen(const std::optional<fs::path>& data, const fs::path& folder) {
  if (!data) return std::nullopt;
  const fs::path from = *data / "interior-kitchen";
  const LuxCoreFile file(from / "kitchen.scn");
  Builder builder(folder, "kitchen");
  for (const std::string& name : file.objects()) {
    const std::string key = "scene.objects." + name;
    std::string path = file.text(key + ".ply");
    std::erase(path, '"');
    builder.material(name, file.material(file.text(key + ".material")));
    if (!builder.mesh_of(from / fs::path(path).filename(), name)) return std::nullopt;
  }
  const auto view = file.numbers("scene.camera.lookat");
  if (view.size() != 6) return std::nullopt;
  json looks =
      camera({view[0], view[1], view[2]}, {view[3], view[4], view[5]}, file.numbers("scene.camera.fieldofview").at(0));
  looks["up"] = {0, 0, 1};
  builder.camera(std::move(looks));
  return builder.scene("LuxCore's kitchen by daylight", 6);
}

/// Its lamps are above what the camera sees.
void add_room(Builder& builder) {
  builder.material("white", diffuse({0.7, 0.7, 0.7}))
      .material("red", diffuse({0.6, 0.15, 0.1}))
      .material("blue", diffuse({0.15, 0.2, 0.55}));
  builder.object(quad("white", {{{-5, 0, 5}, {5, 0, 5}, {5, 0, -5}, {-5, 0, -5}}}))
      .object(quad("white", {{{-5, 0, -5}, {5, 0, -5}, {5, 4, -5}, {-5, 4, -5}}}))
      .object(quad("red", {{{-5, 0, 5}, {-5, 0, -5}, {-5, 4, -5}, {-5, 4, 5}}}))
      .object(quad("blue", {{{5, 0, -5}, {5, 0, 5}, {5, 4, 5}, {5, 4, -5}}}))
      .object(quad("white", {{{-5, 4, -5}, {5, 4, -5}, {5, 4, 5}, {-5, 4, 5}}}));
  builder.mesh(organic(5'000), "white", at(0.7, {-1, 0.8, -0.6}))
      .mesh(smooth_ball(64, 32), "blue", at(0.75, {1, 0.75, 0}));
  builder.camera(camera({0, 2.4, 8}, {0, 0.6, 0}, 26));
}

/// Triangles that face down, tilted, of areas that differ by a factor of 30; hanging over all of the room.
std::vector<TriangleMesh> hanging(std::uint32_t triangles, const std::vector<double>& radiances, double power) {
  Random random(7);
  std::vector<TriangleMesh> meshes(radiances.size());
  struct Piece {
    Vec3d at, u, v;
  };
  std::vector<Piece> pieces;
  double sum = 0;
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const Vec3d down = Vec3d{0, -1, 0} + random.direction() * 0.6;
    const Vec3d across = cross(down, random.direction()), u = across / length(across);
    const Vec3d v = cross(down, u) / length(down);
    const double area = random.magnitude(-1.5, 0), side = std::sqrt(2 * area);
    pieces.push_back(
        {{random.uniform(-4.8, 4.8), random.uniform(2.8, 3.8), random.uniform(-4.8, 4.8)}, u * side, v * side});
    sum += area * radiances[i % radiances.size()];
  }
  const double scale = std::sqrt(power / sum);
  for (std::uint32_t i = 0; i < triangles; ++i) {
    TriangleMesh& mesh = meshes[i % radiances.size()];
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const Piece& piece = pieces[i];
    for (const Vec3d corner : {piece.at, piece.at + piece.u * scale, piece.at + piece.v * scale})
      mesh.positions.push_back(to_float(corner));
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return meshes;
}

}  // namespace

LightScene lamp_scene(const fs::path& folder, std::uint32_t triangles) {
  Builder builder(folder, triangles == 0 ? "one-lamp" : "lamps-" + std::to_string(triangles));
  add_room(builder);
  constexpr double kRadiance = 15, kArea = 4;
  if (triangles == 0) {
    builder.material("lamp", lamp(kRadiance));
    builder.object(quad("lamp", {{{-1, 3.9F, -1}, {1, 3.9F, -1}, {1, 3.9F, 1}, {-1, 3.9F, 1}}}));
    return builder.scene("a room under one quad", 5);
  }
  const std::vector<double> radiances = {2, 6, 20, 60, 200, 600};
  const auto meshes = hanging(triangles, radiances, kRadiance * kArea);
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const std::string name = "lamp " + std::to_string(i);
    builder.material(name, lamp(radiances[i])).mesh(meshes[i], name);
  }
  return builder.scene("a room under " + std::to_string(triangles) + " lamps of many powers", 5);
}

LightScene organic_scene(const fs::path& folder) {
  Builder builder(folder, "organic");
  builder.material("clay", diffuse({0.7, 0.6, 0.5})).material("floor", diffuse(grey(0.5))).material("lamp", lamp(20));
  builder.mesh(organic(100'000), "clay")
      .object(quad("floor", {{{-6, -1.3F, 6}, {6, -1.3F, 6}, {6, -1.3F, -6}, {-6, -1.3F, -6}}}))
      .object(quad("lamp", {{{1.5F, 4, 1}, {1.5F, 4, 3}, {3.5F, 4, 3}, {3.5F, 4, 1}}}))
      .camera(camera({0, 1, 5}, {0, 0, 0}, 32));
  return builder.scene("a body of 100,000 triangles under a square lamp", 6);
}

LightScene caustic_scene() {
  Builder builder(fs::temp_directory_path(), "caustic");
  builder.material("floor", diffuse({0.6, 0.6, 0.6}))
      .material("glass", {{"type", "dielectric"}, {"ior", 1.5}})
      .material("lamp", lamp(60))
      .object(quad("floor", {{{-4, 0, 4}, {4, 0, 4}, {4, 0, -4}, {-4, 0, -4}}}))
      .object({{"type", "sphere"}, {"center", {0, 0.8, 0}}, {"radius", 0.7}, {"material", "glass"}})
      .object(quad("lamp", {{{1.3F, 4, -0.2F}, {1.7F, 4, -0.2F}, {1.7F, 4, 0.2F}, {1.3F, 4, 0.2F}}}))
      .light({{"type", "environment"}, {"radiance", grey(0.1)}})
      .camera(camera({0, 2.5, 5}, {0, 0.4, 0}, 40));
  return builder.scene("a glass ball under a small lamp", 12);
}

std::vector<LightScene> light_scenes(const fs::path& folder) {
  std::vector<LightScene> scenes;
  const auto data = shared_data();
  if (data)
    for (const std::string_view name : kReferenceScenes) scenes.push_back(reference(*data, folder, name));
  else
    std::printf("skipped: the scenes with references and the kitchen (no shared/data beside this checkout)\n");
  scenes.push_back(sphere_furnace(folder));
  scenes.push_back(box_furnace(folder));
  scenes.push_back(product(data, folder));
  if (auto scene = kitchen(data, folder)) scenes.push_back(std::move(*scene));
  scenes.push_back(lamp_scene(folder, 2400));
  return scenes;
}

}  // namespace tessera::bench
