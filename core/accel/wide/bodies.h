#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/accel/accel.h"
#include "core/accel/wide/part_table.h"
#include "core/geometry/shape.h"
#include "core/scene/scene.h"

namespace tessera {

/// What a `WideAccel` searches: the objects of a scene, or fewer bodies than that. Meshes and quads that follow each
/// other in the scene, and lie in the world as they are, may be joined to one mesh: a ray's way through one hierarchy
/// is shorter than through several whose boxes are in each other's way. As their objects follow each other, hits have
/// the same order by bodies as by objects. Immutable, safe from any thread.
class Bodies {
 public:
  struct Body {
    const Shape* shape;          ///< Null for a mesh that is joined.
    const Transform* placement;  ///< Null where it lies in the world as it is.
    std::uint32_t first, count;  ///< Its objects.
    std::uint32_t hierarchy;     ///< Which one is its mesh's, below `hierarchies()`; instances share theirs.
  };

  /// Half of what a hierarchy surely has room for.
  static constexpr std::uint64_t kMostTriangles = 3 << 23;

  /// One for each object.
  static Bodies apart(std::shared_ptr<const Scene> scene);
  /// Runs of objects, each with a shape of its own, are joined where that pays: where a ray that enters the box around
  /// all of a run enters more than one of theirs, on average; and where they are small and many. Their hierarchy is
  /// made as a whole when the first ray comes to it; none has more than so many triangles.
  static Bodies joined(std::shared_ptr<const Scene> scene, std::uint64_t most_triangles = kMostTriangles);

  std::uint32_t size() const {
    return static_cast<std::uint32_t>(are_joined() ? runs_.size() : scene_->objects.size());
  }
  Body operator[](std::uint32_t body) const;
  static bool is_mesh(const Body& body) {
    return body.shape == nullptr || std::holds_alternative<TriangleMesh>(*body.shape);
  }
  /// Of a body that is joined.
  TriangleMesh joined_mesh(const Body& body) const;
  std::size_t hierarchies() const { return scene_->shapes.size() + joined_.size(); }
  /// Of the heap, that the scene doesn't hold: none where no bodies are joined.
  std::size_t bytes() const;
  const Scene& scene() const { return *scene_; }
  const std::shared_ptr<const Scene>& shared_scene() const { return scene_; }
  bool are_joined() const { return !joined_.empty(); }

  /// For each body the box around its objects', whose are `boxes`.
  std::vector<Aabb> around(std::vector<Aabb> boxes) const;

  /// What a ray leaves, as its body's: none for one of the two triangles of a quad.
  PrimitiveId left(PrimitiveId id) const;
  /// The first primitive of an object, as its body's. Here and below some bodies are joined.
  PrimitiveId first_of(std::uint32_t object) const { return {body_of_[object], first_triangle_[object]}; }
  /// An object, and which primitives of its body it has.
  struct Member {
    std::uint32_t object, body, first, count;
    bool is_quad;  ///< Whose two triangles are its one primitive.
  };
  /// Whose a body's primitive is.
  Member member_at(PrimitiveId id) const;
  /// What is hit, as its object's.
  PrimitiveId of_object(PrimitiveId id) const;
  /// The bodies of some objects, both ascending.
  std::vector<std::uint32_t> of_objects(std::span<const std::uint32_t> objects) const;

  /// All objects of a body at once.
  void mark(ObjectMarks& marks, std::uint32_t body) const;

 private:
  /// Objects that are one body.
  struct Run {
    std::uint32_t first, count;
    std::uint32_t joined;  ///< Among the joined; `kAlone` for a single object.
  };
  static constexpr std::uint32_t kAlone = 0xFFFFFFFF;

  explicit Bodies(std::shared_ptr<const Scene> scene) : scene_(std::move(scene)) {}
  void add(std::uint32_t first, std::uint32_t count);

  std::shared_ptr<const Scene> scene_;
  // All empty where each object is a body.
  std::vector<Run> runs_;
  std::vector<std::uint32_t> body_of_;         ///< For each object,
  std::vector<std::uint32_t> first_triangle_;  ///< and where its primitives begin among its body's.
  std::vector<std::uint8_t> is_quad_;          ///< That was joined.
  std::vector<PartTable> joined_;              ///< Of each joined body, whose triangles are whose.
};

}  // namespace tessera
