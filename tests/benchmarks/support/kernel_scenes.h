#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>

#include "core/scene/scene.h"

namespace tessera::bench {

/// A scene that kernels are measured on: one mesh, one camera, one point light.
struct KernelScene {
  std::string name;
  std::shared_ptr<const Scene> scene;
  Camera camera;
  Vec3 light;

  const TriangleMesh& mesh() const { return std::get<TriangleMesh>(scene->shapes.front()); }
  std::size_t triangles() const { return mesh().triangles.size(); }
};

inline constexpr std::array<std::string_view, 6> kKernelScenes = {"bunny",    "organic_100k", "organic_1600k",
                                                                  "interior", "flake",        "terrain"};

/// The bunny from the data beside the checkout; a made body of as many triangles, and a line that says so, where that
/// is missing. The others are made. Precondition: `name` is one of `kKernelScenes`.
KernelScene kernel_scene(std::string_view name);

}  // namespace tessera::bench
