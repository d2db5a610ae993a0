#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace tessera {

/// A scene of Ignis, for which Mitsuba rendered a reference, as a document of ours.
struct ReferenceScene {
  nlohmann::json document;  ///< Paths of its files are from the folder of all scenes with references.
  std::uint32_t max_depth = 0;
};

inline constexpr std::array<std::string_view, 8> kReferenceScenes = {
    "cbox-d1", "cbox-d6", "emissive-plane", "multilight", "plane-d1", "plane-d6", "point", "room"};

/// Reads Ignis' documents in `<folder>/ignis`.
class IgnisReader {
 public:
  explicit IgnisReader(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Throws std::runtime_error, or nlohmann's exceptions, where a document says what this can't.
  ReferenceScene read(std::string_view name) const {
    const nlohmann::json ignis = parse(std::string(name) + ".json");
    ReferenceScene scene;
    scene.max_depth = ignis.at("technique").at("max_depth");
    scene.document = {{"camera", camera(ignis.at("camera"))},
                      {"lights", lights(ignis.at("lights"))},
                      {"materials", nlohmann::json::object()},
                      {"objects", nlohmann::json::array()}};
    for (const auto& entity : ignis.at("entities")) {
      const std::string& entity_name = entity.at("name");
      scene.document["materials"][entity_name] = material(ignis, entity);
      scene.document["objects"].push_back(object(named(ignis.at("shapes"), entity.at("shape")), entity_name));
    }
    return scene;
  }

 private:
  /// A document with those it names as `externals` taken in.
  nlohmann::json parse(const std::string& file) const {
    auto document = nlohmann::json::parse(std::ifstream(folder_ / "ignis" / file));
    for (const auto& external : document.value("externals", nlohmann::json::array())) {
      const nlohmann::json more = parse(external.at("filename"));
      for (const auto& [key, value] : more.items()) document.emplace(key, value);
    }
    return document;
  }

  static const nlohmann::json& named(const nlohmann::json& list, const std::string& name) {
    for (const auto& item : list)
      if (item.at("name") == name) return item;
    throw std::runtime_error("nothing is named " + name);
  }

  static nlohmann::json rgb(const nlohmann::json& value) {
    return value.is_number() ? nlohmann::json{value, value, value} : value;
  }

  /// The columns of a camera's matrix are left, up, direction, position; so image right is direction × up.
  static nlohmann::json camera(const nlohmann::json& ignis) {
    const auto& transform = ignis.at("transform");
    std::array<double, 3> from{}, direction{}, up{};
    if (transform.at(0).is_object()) {
      const auto& view = transform.at(0).at("lookat");
      from = view.at("origin"), direction = view.at("direction"), up = view.at("up");
    } else {
      for (std::size_t row = 0; row < 3; ++row) {
        up[row] = transform.at(4 * row + 1);
        direction[row] = transform.at(4 * row + 2);
        from[row] = transform.at(4 * row + 3);
      }
    }
    std::array<double, 3> at = from;
    for (std::size_t i = 0; i < 3; ++i) at[i] += direction[i];
    return {{"type", only(ignis, "type", "perspective")},
            {"from", from},
            {"at", at},
            {"up", up},
            {"fov", ignis.at("fov")},  // along both sides of these square images
            {"near", ignis.at("near_clip")},
            {"far", ignis.at("far_clip")}};
  }

  /// All but area lights, which are emission of their entities' materials.
  static nlohmann::json lights(const nlohmann::json& ignis) {
    nlohmann::json lights = nlohmann::json::array();
    for (const auto& light : ignis) {
      if (light.at("type") == "area") continue;
      if (light.at("type") == "constant")
        lights.push_back({{"type", "environment"}, {"radiance", rgb(light.at("radiance"))}});
      else
        lights.push_back({{"type", only(light, "type", "point")},
                          {"position", light.at("position")},
                          {"intensity", rgb(light.at("intensity"))}});
    }
    return lights;
  }

  static nlohmann::json material(const nlohmann::json& ignis, const nlohmann::json& entity) {
    const auto& bsdf = named(ignis.at("bsdfs"), entity.at("bsdf"));
    nlohmann::json material = {{"type", only(bsdf, "type", "diffuse")}, {"color", rgb(bsdf.at("reflectance"))}};
    for (const auto& light : ignis.at("lights"))
      if (light.at("type") == "area" && light.at("entity") == entity.at("name"))
        material["emission"] = rgb(light.at("radiance"));
    return material;
  }

  static nlohmann::json object(const nlohmann::json& shape, const std::string& material) {
    const std::filesystem::path path = std::filesystem::path("ignis") / shape.at("filename").get<std::string>();
    nlohmann::json object = {{"type", "file"}, {"path", path.lexically_normal().string()}, {"material", material}};
    if (shape.contains("transform")) object["transform"] = shape["transform"];
    return object;
  }

  static const nlohmann::json& only(const nlohmann::json& item, const char* key, const char* value) {
    if (item.at(key) != value) throw std::runtime_error("a " + item.at(key).dump() + " has no place in this reader");
    return item.at(key);
  }

  std::filesystem::path folder_;
};

}  // namespace tessera
