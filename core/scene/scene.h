#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/bounds/outline.h"
#include "core/geometry/shape.h"
#include "core/math/transform.h"
#include "core/scene/camera.h"
#include "core/scene/light.h"
#include "core/scene/material.h"
#include "core/scene/texture.h"

namespace tessera {

/// A shape with a material, somewhere. An object with a `placement` is an instance: its rays are traced in the
/// shape's own space.
struct Object {
  std::uint32_t shape = 0;
  std::uint32_t material = 0;
  std::optional<Transform> placement;
};

/// Something that a scene lost or ignored on its way in and that still renders: counted, named, reported.
struct SceneWarning {
  std::string pointer;  ///< JSON pointer of the scene document, or a file's name with a line.
  std::string detail;
};

/// In pixels.
struct ImageSize {
  std::uint32_t width = 0, height = 0;
  bool operator==(const ImageSize&) const = default;
};

/// A level plane that only shows shadows: camera rays that meet nothing see the background through it, darker where
/// objects hide the sky. All other rays pass it. The path tracer alone shows it.
struct Ground {
  float height = 0;       ///< On the y axis.
  float darkness = 0.6F;  ///< What is taken from the background where the whole sky is hidden; in 0..1.
};

/// All that is rendered. Made by the parser, valid when made (every index in range, every number finite, at most
/// 2^32 − 1 primitives with instances counted), and never changed: share it across threads freely.
///
/// A primitive's identity is the pair (object, primitive within the object's shape); ties at equal t go to the
/// smaller pair.
struct Scene {
  std::vector<Shape> shapes;
  std::vector<Object> objects;
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<Light> lights;
  Rgb background;
  std::optional<Ground> ground;
  std::optional<Camera> camera;    ///< The scene's own view; a job may bring another.
  std::optional<ImageSize> image;  ///< The size that the scene is made for, where a job asks for none.
  std::vector<SceneWarning> warnings;
  std::vector<Aabb> shape_bounds;  ///< Of each shape, for `local_bounds`; `with_bounds` makes them.
};

/// What stands for the sky: the scene's environment, or else its background all around.
EnvironmentLight environment_of(const Scene& scene);

/// `scene` with the boxes of its shapes: the last step for whoever puts a scene together or gives one other shapes.
Scene with_bounds(Scene scene);

/// The boxes of the scene's shapes, each in its own space; empty for a mesh without triangles. Throws
/// `std::logic_error` when shapes were added after the boxes were made.
std::span<const Aabb> local_bounds(const Scene& scene);

/// The box of a placed object in world space: empty for an empty shape; padded for the rounding of the placement
/// itself, not for that of rays (core/bounds/cull_ray.h does that per ray).
Aabb world_bounds(const Scene& scene, const Object& object);

/// The same for a part of the object that lies in the box `local` of the shape's own space.
Aabb world_bounds(const Object& object, const Aabb& local);

/// An outline in the shape's own space, carried to the world like the object. Padded like its box.
Outline world_outline(const Object& object, const Outline& local);

/// The boxes of all objects.
std::vector<Aabb> world_bounds(const Scene& scene);

/// Bytes of heap that the scene holds, to a few percent, all textures decoded; the studio, which all share, left out.
std::size_t memory_bytes(const Scene& scene);

}  // namespace tessera
