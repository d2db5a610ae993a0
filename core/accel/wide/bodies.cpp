#include "core/accel/wide/bodies.h"

#include <algorithm>

namespace tessera {
namespace {

constexpr std::uint64_t kMostTriangles = 1 << 21;

/// The triangles of an object that may be joined to others; 0 for one that may not.
std::uint64_t joinable_triangles(const Scene& scene, const Object& object) {
  const auto* mesh = std::get_if<TriangleMesh>(&scene.shapes[object.shape]);
  return mesh && !object.placement ? mesh->triangles.size() : 0;
}

/// How many objects from `first` on follow each other that may be joined, together.
std::uint32_t run_from(const Scene& scene, std::uint32_t first) {
  std::uint64_t triangles = 0;
  std::uint32_t end = first;
  for (; end < scene.objects.size(); ++end) {
    const std::uint64_t more = joinable_triangles(scene, scene.objects[end]);
    triangles += more;
    if (more == 0 || triangles > kMostTriangles) break;
  }
  return std::max(1U, end - first);
}

bool are_in_each_others_way(const Scene& scene, std::uint32_t first, std::uint32_t count) {
  const std::span<const Aabb> boxes = local_bounds(scene);
  Aabb all;
  double sum = 0;
  for (std::uint32_t object = first; object < first + count; ++object) {
    const Aabb& box = boxes[scene.objects[object].shape];
    all.extend(box);
    sum += half_area(box);
  }
  return sum > half_area(all);
}

}  // namespace

Bodies::Bodies(std::shared_ptr<const Scene> scene)
    : scene_(std::move(scene)),
      body_of_(scene_->objects.size()),
      first_triangle_(scene_->objects.size()),
      hierarchies_(scene_->shapes.size()) {}

Bodies Bodies::apart(std::shared_ptr<const Scene> scene) {
  Bodies bodies(std::move(scene));
  for (std::uint32_t object = 0; object < bodies.body_of_.size(); ++object) bodies.add(object, 1);
  return bodies;
}

Bodies Bodies::joined(std::shared_ptr<const Scene> scene) {
  Bodies bodies(std::move(scene));
  for (std::uint32_t first = 0; first < bodies.body_of_.size();) {
    const std::uint32_t run = run_from(*bodies.scene_, first);
    if (run > 1 && are_in_each_others_way(*bodies.scene_, first, run))
      bodies.add(first, run);
    else
      for (std::uint32_t object = first; object < first + run; ++object) bodies.add(object, 1);
    first += run;
  }
  return bodies;
}

void Bodies::add(std::uint32_t first, std::uint32_t count) {
  const Object& object = scene_->objects[first];
  Body body{&scene_->shapes[object.shape], object.placement ? &*object.placement : nullptr, first, count, object.shape};
  std::uint32_t triangles = 0;
  for (std::uint32_t member = first; member < first + count; ++member) {
    body_of_[member] = size();
    first_triangle_[member] = triangles;
    if (count > 1) triangles += static_cast<std::uint32_t>(joinable_triangles(*scene_, scene_->objects[member]));
  }
  if (count > 1) {
    body.shape = &meshes_.emplace_back(mesh_of(first, count));
    body.hierarchy = static_cast<std::uint32_t>(hierarchies_++);
  }
  bodies_.push_back(body);
}

TriangleMesh Bodies::mesh_of(std::uint32_t first, std::uint32_t count) const {
  TriangleMesh all;
  for (std::uint32_t object = first; object < first + count; ++object) {
    const auto& mesh = std::get<TriangleMesh>(scene_->shapes[scene_->objects[object].shape]);
    const auto corners = static_cast<std::uint32_t>(all.positions.size());
    all.positions.insert(all.positions.end(), mesh.positions.begin(), mesh.positions.end());
    for (const TriangleIndices& t : mesh.triangles)
      all.triangles.push_back({t[0] + corners, t[1] + corners, t[2] + corners});
  }
  return all;
}

std::size_t Bodies::bytes() const {
  std::size_t bytes = bodies_.size() * sizeof(Body) + 2 * body_of_.size() * sizeof(std::uint32_t);
  for (const Shape& shape : meshes_) {
    const auto& mesh = std::get<TriangleMesh>(shape);
    bytes += mesh.positions.size() * sizeof(Vec3) + mesh.triangles.size() * sizeof(TriangleIndices);
  }
  return bytes;
}

std::vector<Aabb> Bodies::around(std::span<const Aabb> boxes) const {
  std::vector<Aabb> all(bodies_.size());
  for (std::size_t object = 0; object < boxes.size(); ++object) all[body_of_[object]].extend(boxes[object]);
  return all;
}

PrimitiveId Bodies::of_body(PrimitiveId id) const {
  if (id.object >= body_of_.size()) return kNoPrimitive;
  return {body_of_[id.object], first_triangle_[id.object] + id.primitive};
}

PrimitiveId Bodies::of_object(PrimitiveId id) const {
  const Body& body = bodies_[id.object];
  if (body.count == 1) return {body.first, id.primitive};
  const auto begin = first_triangle_.begin() + body.first;
  const auto member = std::upper_bound(begin, begin + body.count, id.primitive) - begin - 1;
  return {body.first + static_cast<std::uint32_t>(member), id.primitive - begin[member]};
}

std::vector<std::uint32_t> Bodies::of_objects(std::span<const std::uint32_t> objects) const {
  std::vector<std::uint32_t> some;
  for (const std::uint32_t object : objects)
    if (some.empty() || some.back() != body_of_[object]) some.push_back(body_of_[object]);
  return some;
}

void Bodies::mark(ObjectMarks& marks, std::uint32_t body) const {
  const auto [first, count] = std::pair(bodies_[body].first, bodies_[body].count);
  for (std::uint32_t object = first; object < first + count; ++object) marks.mark(object);
}

}  // namespace tessera
