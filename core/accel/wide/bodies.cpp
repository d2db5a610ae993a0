#include "core/accel/wide/bodies.h"

#include <algorithm>
#include <array>

namespace tessera {
namespace {

/// Objects that lie apart are joined where they are more than fans go through one by one, and small: of large meshes
/// most may never be needed.
constexpr std::uint32_t kMany = 65;
constexpr std::uint64_t kSmallMesh = 4096;

/// A quad's, in the corners that `intersect` takes for them: it is hit where they are.
constexpr std::array<TriangleIndices, 2> kQuadTriangles{{{0, 1, 2}, {0, 2, 3}}};

/// Whether both halves are triangles as meshes have them.
bool is_usable(const Quad& quad) {
  const auto& [a, b, c, d] = quad.corners;
  return a != b && b != c && a != c && c != d && a != d;
}

/// What an object brings to a joined mesh; nothing for one that may not be joined.
struct Part {
  std::uint64_t triangles = 0, positions = 0;
};
Part part_of(const Shape& shape) {
  if (const auto* quad = std::get_if<Quad>(&shape)) return is_usable(*quad) ? Part{2, 4} : Part{};
  const auto* mesh = std::get_if<TriangleMesh>(&shape);
  return mesh ? Part{mesh->triangles.size(), mesh->positions.size()} : Part{};
}

void append(TriangleMesh& all, std::span<const Vec3> positions, std::span<const TriangleIndices> triangles) {
  const auto corners = static_cast<std::uint32_t>(all.positions.size());
  all.positions.insert(all.positions.end(), positions.begin(), positions.end());
  for (const TriangleIndices& t : triangles) all.triangles.push_back({t[0] + corners, t[1] + corners, t[2] + corners});
}

/// How many objects from `first` on follow each other that may be joined, together. `uses` are those of each shape:
/// of several objects with one shape there would be as many copies.
std::uint32_t run_from(const Scene& scene, const std::vector<std::uint32_t>& uses, std::uint32_t first,
                       std::uint64_t most_triangles) {
  Part all;
  std::uint32_t end = first;
  for (; end < scene.objects.size(); ++end) {
    const Object& object = scene.objects[end];
    const Part part = part_of(scene.shapes[object.shape]);
    all.triangles += part.triangles;
    all.positions += part.positions;
    if (object.placement || uses[object.shape] > 1 || part.triangles == 0 || all.triangles > most_triangles ||
        all.positions > 3 * most_triangles)
      break;
  }
  return std::max(1U, end - first);
}

/// How many objects from `first` on are small, of `count`.
std::uint32_t small_from(const Scene& scene, std::uint32_t first, std::uint32_t count) {
  std::uint32_t small = 0;
  while (small < count && part_of(scene.shapes[scene.objects[first + small].shape]).triangles <= kSmallMesh) ++small;
  return small;
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

Bodies Bodies::apart(std::shared_ptr<const Scene> scene) { return Bodies(std::move(scene)); }

Bodies::Body Bodies::operator[](std::uint32_t body) const {
  const Run run = are_joined() ? runs_[body] : Run{body, 1, kAlone};
  if (run.joined != kAlone) {
    const auto hierarchy = static_cast<std::uint32_t>(scene_->shapes.size()) + run.joined;
    return {nullptr, nullptr, run.first, run.count, hierarchy};
  }
  const Object& object = scene_->objects[run.first];
  return {&scene_->shapes[object.shape], object.placement ? &*object.placement : nullptr, run.first, 1, object.shape};
}

Bodies Bodies::joined(std::shared_ptr<const Scene> scene, std::uint64_t most_triangles) {
  Bodies bodies(std::move(scene));
  const Scene& all = *bodies.scene_;
  for (std::vector<std::uint32_t>* of_object : {&bodies.body_of_, &bodies.first_triangle_})
    of_object->resize(all.objects.size());
  bodies.is_quad_.resize(all.objects.size());
  std::vector<std::uint32_t> uses(all.shapes.size());
  for (const Object& object : all.objects) ++uses[object.shape];
  for (std::uint32_t first = 0; first < all.objects.size();) {
    const std::uint32_t end = first + run_from(all, uses, first, most_triangles);
    if (end - first > 1 && are_in_each_others_way(all, first, end - first)) {
      bodies.add(first, end - first);
      first = end;
    }
    while (first < end) {
      const std::uint32_t small = small_from(all, first, end - first), count = small > kMany ? small : 1;
      bodies.add(first, count);
      first += count;
    }
  }
  if (bodies.joined_.empty()) return apart(bodies.scene_);
  bodies.runs_.shrink_to_fit();
  return bodies;
}

void Bodies::add(std::uint32_t first, std::uint32_t count) {
  const auto body = static_cast<std::uint32_t>(runs_.size());
  std::uint32_t triangles = 0;
  for (std::uint32_t member = first; member < first + count; ++member) {
    body_of_[member] = body;
    first_triangle_[member] = triangles;
    if (count == 1) continue;
    const Shape& shape = scene_->shapes[scene_->objects[member].shape];
    triangles += static_cast<std::uint32_t>(part_of(shape).triangles);
    is_quad_[member] = std::holds_alternative<Quad>(shape);
  }
  runs_.push_back({first, count, count > 1 ? static_cast<std::uint32_t>(joined_.size()) : kAlone});
  if (count > 1) joined_.emplace_back(std::span(first_triangle_).subspan(first, count), triangles);
}

TriangleMesh Bodies::joined_mesh(const Body& body) const {
  TriangleMesh all;
  Part size;
  for (std::uint32_t object = body.first; object < body.first + body.count; ++object) {
    const Part part = part_of(scene_->shapes[scene_->objects[object].shape]);
    size.triangles += part.triangles;
    size.positions += part.positions;
  }
  all.triangles.reserve(size.triangles);
  all.positions.reserve(size.positions);
  for (std::uint32_t object = body.first; object < body.first + body.count; ++object) {
    const Shape& shape = scene_->shapes[scene_->objects[object].shape];
    if (const auto* mesh = std::get_if<TriangleMesh>(&shape))
      append(all, mesh->positions, mesh->triangles);
    else
      append(all, std::get<Quad>(shape).corners, kQuadTriangles);
  }
  return all;
}

std::size_t Bodies::bytes() const {
  std::size_t bytes = runs_.size() * sizeof(Run) + body_of_.size() * (2 * sizeof(std::uint32_t) + 1);
  for (const PartTable& members : joined_) bytes += sizeof(PartTable) + members.bytes();
  return bytes;
}

std::vector<Aabb> Bodies::around(std::vector<Aabb> boxes) const {
  if (!are_joined()) return boxes;
  std::vector<Aabb> all(runs_.size());
  for (std::size_t object = 0; object < boxes.size(); ++object) all[body_of_[object]].extend(boxes[object]);
  return all;
}

PrimitiveId Bodies::left(PrimitiveId id) const {
  if (id.object >= body_of_.size() || is_quad_[id.object]) return kNoPrimitive;
  return {body_of_[id.object], first_triangle_[id.object] + id.primitive};
}

Bodies::Member Bodies::member_at(PrimitiveId id) const {
  const Run& run = runs_[id.object];
  if (run.joined == kAlone) return {run.first, id.object, 0, 0xFFFFFFFF, false};
  const auto begins = std::span(first_triangle_).subspan(run.first, run.count);
  const std::uint32_t at = joined_[run.joined].part_of(id.primitive, begins), object = run.first + at;
  const std::uint32_t end = at + 1 < run.count ? begins[at + 1] : 0xFFFFFFFF;
  return {object, id.object, begins[at], end - begins[at], is_quad_[object] != 0};
}

PrimitiveId Bodies::of_object(PrimitiveId id) const {
  const Member member = member_at(id);
  return {member.object, member.is_quad ? 0 : id.primitive - member.first};
}

std::vector<std::uint32_t> Bodies::of_objects(std::span<const std::uint32_t> objects) const {
  std::vector<std::uint32_t> some;
  for (const std::uint32_t object : objects)
    if (some.empty() || some.back() != body_of_[object]) some.push_back(body_of_[object]);
  return some;
}

void Bodies::mark(ObjectMarks& marks, std::uint32_t body) const {
  if (!are_joined()) return marks.mark(body);
  const std::uint32_t first = runs_[body].first, end = first + runs_[body].count;
  if (marks.is_marked(end - 1)) return;
  for (std::uint32_t object = first; object < end; ++object) marks.mark(object);
}

}  // namespace tessera
