#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <string_view>
#include <system_error>
#include <variant>
#include <vector>

#include "proto/import/broken_file.h"
#include "proto/import/gltf/gltf.h"
#include "proto/import/import.h"
#include "proto/import/nff.h"
#include "proto/import/obj.h"
#include "proto/import/ply.h"
#include "proto/import/stl.h"

namespace tessera {

/// What an import of `file_bytes` bytes may never give, whatever the file says; empty when all is well.
inline std::string fault_of_import(const proto::Imported& imported, std::size_t file_bytes) {
  std::size_t heap = 0;
  for (const proto::ImportedPart& part : imported.parts) {
    if (part.material && *part.material >= imported.materials.size()) return "a material out of range";
    const auto* mesh = std::get_if<TriangleMesh>(&part.shape);
    if (mesh == nullptr) {
      const Aabb box = bounds(part.shape);
      if (!is_finite(box.lo) || !is_finite(box.hi)) return "a shape that isn't finite";
      continue;
    }
    if (mesh->triangles.empty()) return "a mesh without triangles";
    if (!mesh->normals.empty() && mesh->normals.size() != mesh->positions.size()) return "a normal too many or few";
    heap += mesh->positions.size() * 24 + mesh->triangles.size() * 12;
    if (mesh->attributes) {
      const MeshAttributes& has = *mesh->attributes;
      heap += memory_bytes(has);
      for (const std::size_t count : {has.uvs[0].size(), has.uvs[1].size(), has.tangents.size(), has.colors.size()})
        if (count != 0 && count != mesh->positions.size()) return "an attribute too many or few";
      for (const Vec2 uv : has.uvs[0])
        if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) return "a texture coordinate that isn't finite";
      for (const auto& color : has.colors)
        for (const float c : color)
          if (!(c >= 0 && c <= 1)) return "a colour beyond 0 to 1";
    }
    for (const TriangleIndices& t : mesh->triangles) {
      for (const std::uint32_t corner : t) {
        if (corner >= mesh->positions.size()) return "an index out of range";
        if (!is_finite(mesh->positions[corner])) return "a corner that isn't finite";
        if (!mesh->normals.empty() && !is_finite(mesh->normals[corner])) return "a normal that isn't finite";
      }
    }
  }
  for (const Material& material : imported.materials) {
    for (const TextureUse& use : material.textures)
      if (use.texture >= imported.textures.size() || use.channel > 3) return "a texture out of range";
    const auto* whitted = std::get_if<WhittedSurface>(&material.surface);
    if (!whitted) continue;
    const WhittedSurface& m = *whitted;
    for (const Rgb c : {m.diffuse, m.specular, m.reflect, m.transmit}) {
      if (!is_finite(c) || std::min({c.r, c.g, c.b}) < 0) return "a material that isn't finite, or is negative";
    }
    if (!(m.ior > 0) || !(m.shininess >= 0)) return "a material with an impossible index or shininess";
  }
  if (heap > 64 * file_bytes + 4096) return "more memory than a small multiple of the file";
  if (imported.parts.empty() && imported.warnings.empty()) return "nothing imported, and no word about it";
  return "";
}

/// What a refusal must have; empty when it has it.
inline std::string fault_of_refusal(const std::vector<proto::FieldError>& errors, std::string_view file_name) {
  if (errors.empty() || errors.size() > proto::kMaxFieldErrors) return "no errors, or too many";
  for (const proto::FieldError& error : errors) {
    if (!error.pointer.starts_with(file_name) || error.detail.empty()) return "an error that doesn't name its place";
  }
  return "";
}

/// Makes an OBJ file its own material library: OBJ and MTL ignore each other's statements.
class OwnLibrary {
 public:
  ~OwnLibrary() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }

  proto::CompanionSource of(const std::string& bytes) const {
    if (bytes.find("newmtl") == std::string::npos) return nullptr;
    std::ofstream(path_, std::ios::binary) << bytes;
    return [this](std::string_view) { return path_; };
  }

 private:
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / ("tessera_" + std::to_string(std::random_device{}()) + ".mtl");
};

/// Imports bytes as a file of a format; what is wrong with the outcome, which may be a refusal.
inline std::string fault_of_reading(proto::FileFormat format, const std::string& bytes,
                                    const proto::CompanionSource& companions = nullptr) {
  constexpr std::string_view kName = "fuzzed";
  try {
    switch (format) {
      case proto::FileFormat::nff:
        return fault_of_import(proto::import_nff(bytes, kName), bytes.size());
      case proto::FileFormat::ply:
        return fault_of_import(proto::import_ply(bytes, kName, companions), bytes.size());
      case proto::FileFormat::stl:
        return fault_of_import(proto::import_stl(bytes, kName), bytes.size());
      case proto::FileFormat::obj:
        return fault_of_import(proto::import_obj(bytes, kName, companions), bytes.size());
      case proto::FileFormat::gltf:
        return fault_of_import(proto::import_gltf(bytes, kName, companions, {}, 1 << 24),
                               256 * bytes.size() + (1 << 20));
    }
  } catch (const proto::BrokenFile& broken) {
    return fault_of_refusal(broken.errors, kName);
  }
  return "no such format";
}

}  // namespace tessera
