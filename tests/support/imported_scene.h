#pragma once

#include <filesystem>
#include <memory>

#include "proto/import/import.h"

namespace tessera {

/// A file as a scene of its own, placed as it is; null when it can't be read. A part without a material has the
/// first one, which is the default where the file brings none.
inline std::shared_ptr<Scene> imported_scene(const std::filesystem::path& path) {
  const auto format = proto::format_of(path.filename().string());
  if (!format) return nullptr;
  auto file = proto::import_file(path, *format, path.filename().string(), [](auto) { return std::nullopt; });
  if (!file) return nullptr;
  Scene scene;
  for (proto::ImportedPart& part : file->parts) {
    scene.objects.push_back({static_cast<std::uint32_t>(scene.shapes.size()), part.material.value_or(0), {}});
    scene.shapes.push_back(std::move(part.shape));
  }
  scene.materials = file->materials;
  if (scene.materials.empty()) scene.materials.emplace_back();
  scene.lights = file->lights;
  scene.background = file->background.value_or(Rgb{});
  if (!file->cameras.empty()) scene.camera = file->cameras.front().camera;
  return std::make_shared<Scene>(with_bounds(std::move(scene)));
}

}  // namespace tessera
