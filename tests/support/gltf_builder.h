#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera {

/// Puts a glTF file together: a document that the caller changes as he likes, and a buffer that grows.
class GltfBuilder {
 public:
  static constexpr int kUint8 = 5121, kUint16 = 5123, kUint32 = 5125, kFloat = 5126;

  nlohmann::json json{{"asset", {{"version", "2.0"}}}};
  std::string buffer;

  /// The number of a new view of bytes that are appended to the buffer.
  std::size_t add_view(std::string_view bytes) {
    buffer.resize((buffer.size() + 3) / 4 * 4);
    json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", bytes.size()}});
    buffer += bytes;
    return json["bufferViews"].size() - 1;
  }

  /// The number of a new accessor of these values.
  template <typename T>
  std::size_t add_accessor(const std::vector<T>& values, const char* type, int component, std::size_t components) {
    const std::size_t view =
        add_view({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(values.front())});
    json["accessors"].push_back(
        {{"bufferView", view}, {"componentType", component}, {"count", values.size() / components}, {"type", type}});
    return json["accessors"].size() - 1;
  }
  std::size_t add_floats(const std::vector<float>& values, std::size_t components) {
    constexpr const char* kTypes[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    return add_accessor(values, kTypes[components - 1], kFloat, components);
  }
  std::size_t add_positions(const std::vector<float>& values) {
    const std::size_t accessor = add_floats(values, 3);
    json["accessors"][accessor]["min"] = {0, 0, 0};
    json["accessors"][accessor]["max"] = {1, 1, 1};
    return accessor;
  }

  /// A mesh of a triangle, and a node that shows it: the one scene.
  void add_triangle() {
    const std::size_t positions = add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    json["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", positions}}}}}}}};
    json["nodes"] = {{{"mesh", 0}}};
    json["scenes"] = {{{"nodes", {0}}}};
  }
  nlohmann::json& primitive() { return json["meshes"][0]["primitives"][0]; }

  std::string glb() {
    if (!buffer.empty()) {
      buffer.resize((buffer.size() + 3) / 4 * 4);
      json["buffers"][0]["byteLength"] = buffer.size();
    }
    std::string text = json.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string chunks = word(text.size()) + "JSON" + text;
    if (!buffer.empty()) chunks += word(buffer.size()) + std::string("BIN\0", 4) + buffer;
    return "glTF" + word(2) + word(12 + chunks.size()) + chunks;
  }

  static std::string word(std::size_t value) {
    std::string bytes(4, '\0');
    for (std::size_t i = 0; i < 4; ++i) bytes[i] = static_cast<char>(value >> (8 * i) & 255);
    return bytes;
  }
};

}  // namespace tessera
