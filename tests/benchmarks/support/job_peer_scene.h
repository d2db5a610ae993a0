#pragma once

#include <filesystem>
#include <string>

#include "core/geometry/triangle_mesh.h"

namespace tessera::bench {

/// What every renderer is to show: a diffuse body on a square of ground, under one point light, seen from the front.
struct JobScene {
  std::string name;
  TriangleMesh body;  ///< Around the origin, within 2 of it; y is up.
  float ground;       ///< Its height.
};

/// The organic body of about that many triangles, on ground that it touches.
JobScene job_scene(const std::string& name, std::uint32_t triangles);

/// Write the scene in a program's own form, with the same camera, light and surfaces, and without reflections. Light
/// falls off with distance in Tessera alone, so its intensity is chosen to look like the others'. All give the path
/// of the scene's file. They throw std::runtime_error when a file can't be written.
std::filesystem::path write_for_tessera(const JobScene& scene, const std::filesystem::path& folder,
                                        const std::string& mesh_format);
std::filesystem::path write_for_tachyon(const JobScene& scene, const std::filesystem::path& folder);
std::filesystem::path write_for_povray(const JobScene& scene, const std::filesystem::path& folder);

}  // namespace tessera::bench
