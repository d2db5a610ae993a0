#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tests/benchmarks/support/kernel_scenes.h"

namespace tessera::bench {

/// How little bodies stand: side by side on a field, so that rays come to several boxes; or strewn in a cube, so that a
/// ray through it comes to less than one.
enum class Crowd { field, swarm };
inline constexpr std::array kCrowds = {Crowd::field, Crowd::swarm};
std::string_view name(Crowd crowd);

/// The same triangles in three ways.
struct ManyObjects {
  KernelScene one;                        ///< In one mesh.
  std::shared_ptr<const Scene> separate;  ///< As a mesh of its own for each body, in the world as it is.
  std::shared_ptr<const Scene> placed;    ///< The same, each with a placement; but for a rounding.
  std::uint32_t triangles_each;
};

/// Turned bodies of 12 or 224 triangles each, no corner shared between bodies, in no order.
ManyObjects many_objects(Crowd crowd, std::uint32_t objects, std::uint32_t triangles_each);

/// Turned, stretched instances of one mesh of 5,000 triangles.
struct ManyInstances {
  KernelScene scene;
  std::vector<std::array<float, 12>> rows;  ///< Of their placements.
};
ManyInstances many_instances(Crowd crowd, std::uint32_t instances);

}  // namespace tessera::bench
