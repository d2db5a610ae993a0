#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace tessera::bench {

struct BenchScene {
  std::string name;
  std::shared_ptr<const Scene> scene;
  Camera camera;
  bool from_issue = false;  ///< One that the issue's bars are about, not one of our own.
};

/// Haines' seven standard scenes, three meshes and an interior from the data beside the checkout (each one that is
/// missing is said and left out), and five that are made here: every shape and material at once, a sphere of 82k
/// triangles, hills of 100k, a thousand instances of one mesh, and one object in an empty picture. Only those whose
/// name contains `name_part`.
std::vector<BenchScene> bench_scenes(const std::string& name_part = "");

}  // namespace tessera::bench
