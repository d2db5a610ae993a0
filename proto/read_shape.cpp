#include "proto/read_shape.h"

#include <limits>

#include "proto/read_values.h"

namespace tessera::proto {
namespace {

using Maybe = std::optional<InlineShape>;

constexpr NumberRange kRadius{0, kLargestCoordinate, true, "a number greater than 0 and less than 1e18"};
constexpr NumberRange kConeRadius{0, kLargestCoordinate, false, "a number from 0 to 1e18"};

template <typename S>
Maybe when(bool good, const S& shape) {
  if (!good) return std::nullopt;
  Maybe out(std::in_place);
  out->shape = shape;
  return out;
}

/// A required field, read; false also when it is missing.
template <typename T>
bool read_required(JsonFields& fields, std::string_view name, T& out, const NumberRange& range) {
  const auto field = fields.required(name);
  return field && read(field, out, range);
}

bool refuse_same_ends(const JsonFields& fields, bool good, Vec3 base, Vec3 apex) {
  if (good && base == apex) return fields.value().error("\"base\" and \"apex\" are the same point; move one of them.");
  return good;
}

Maybe read_sphere(JsonFields& fields) {
  fields.call("a sphere");
  Sphere sphere;
  bool good = read_required(fields, "center", sphere.center, kCoordinate);
  good &= read_required(fields, "radius", sphere.radius, kRadius);
  return when(good, sphere);
}

Maybe read_cylinder(JsonFields& fields) {
  fields.call("a cylinder");
  Cylinder cylinder;
  bool good = read_required(fields, "base", cylinder.base, kCoordinate);
  good &= read_required(fields, "apex", cylinder.apex, kCoordinate);
  good = refuse_same_ends(fields, good, cylinder.base, cylinder.apex);
  good &= read_required(fields, "radius", cylinder.radius, kRadius);
  return when(good, cylinder);
}

Maybe read_cone(JsonFields& fields) {
  fields.call("a cone");
  Cone cone;
  bool good = read_required(fields, "base", cone.base, kCoordinate);
  good &= read_required(fields, "apex", cone.apex, kCoordinate);
  good = refuse_same_ends(fields, good, cone.base, cone.apex);
  bool radii = read_required(fields, "base_radius", cone.base_radius, kConeRadius);
  radii &= read_required(fields, "apex_radius", cone.apex_radius, kConeRadius);
  if (radii && cone.base_radius == 0 && cone.apex_radius == 0) {
    radii = fields.value().error("Both radii are 0; at least one must be greater.");
  }
  return when(good && radii, cone);
}

Maybe read_disk(JsonFields& fields) {
  fields.call("a disk");
  Disk disk;
  bool good = read_required(fields, "center", disk.center, kCoordinate);
  const auto normal = fields.required("normal");
  good &= normal && read_direction(normal, disk.normal);
  good &= read_required(fields, "radius", disk.radius, kRadius);
  return when(good, disk);
}

Maybe read_quad(JsonFields& fields) {
  fields.call("a quad");
  const auto corners = fields.required("corners");
  if (!corners) return std::nullopt;
  Quad quad;
  if (corners->kind() != JsonKind::array || corners->size() != quad.corners.size()) {
    corners->expected("an array of 4 corners");
    return std::nullopt;
  }
  bool good = true;
  std::size_t i = 0;
  for (const JsonCursor& corner : corners->elements()) good &= read(corner, quad.corners[i++], kCoordinate);
  for (std::size_t a = 0; good && a < 4; ++a) {
    for (std::size_t b = a + 1; good && b < 4; ++b) {
      if (quad.corners[a] == quad.corners[b]) {
        good = corners->error("Corners " + std::to_string(a) + " and " + std::to_string(b) +
                              " are the same point; a quad needs 4 different ones.");
      }
    }
  }
  return when(good, quad);
}

bool read_positions(JsonCursor value, std::vector<Vec3>& positions) {
  if (value.kind() != JsonKind::array) return value.expected("an array of positions [x, y, z]");
  positions.reserve(value.size());
  bool good = true;
  for (const JsonCursor& element : value.elements()) {
    // Coordinates that are too large to render are no error here: they cost their triangles.
    good &= read(element, positions.emplace_back(), kAnyNumber);
    if (value.errors().full()) return false;
  }
  return good;
}

bool read_triangle(JsonCursor value, TriangleIndices& triangle, std::uint64_t position_count) {
  if (value.kind() != JsonKind::array || value.size() != 3) return value.expected("an array of 3 indices");
  bool good = true;
  std::size_t corner = 0;
  for (const JsonCursor& element : value.elements()) {
    std::uint64_t index = 0;
    const bool is_index = read(element, index, 0, std::numeric_limits<std::uint32_t>::max());
    good &= is_index;
    if (is_index && index >= position_count) {
      good = element.error("Index " + std::to_string(index) + " is out of range: " +
                           (position_count > 0
                                ? "with this many positions, 0 to " + std::to_string(position_count - 1) + " will do."
                                : "there are no positions."));
    }
    triangle[corner++] = static_cast<std::uint32_t>(index);
  }
  return good;
}

bool read_triangles(JsonCursor value, std::vector<TriangleIndices>& triangles, std::uint64_t position_count) {
  if (value.kind() != JsonKind::array) return value.expected("an array of triangles [i, j, k]");
  triangles.reserve(value.size());
  bool good = true;
  for (const JsonCursor& element : value.elements()) {
    good &= read_triangle(element, triangles.emplace_back(), position_count);
    if (value.errors().full()) return false;
  }
  return good;
}

bool read_normals(JsonCursor value, std::vector<Vec3>& normals, std::uint64_t position_count) {
  if (value.kind() != JsonKind::array) return value.expected("an array of normals [x, y, z]");
  if (value.size() != position_count) {
    return value.error("There are " + std::to_string(value.size()) + " normals for " + std::to_string(position_count) +
                       " positions; give one for each, or leave \"normals\" out.");
  }
  normals.reserve(value.size());
  bool good = true;
  for (const JsonCursor& element : value.elements()) {
    Vec3& normal = normals.emplace_back();
    const bool is_vector = read(element, normal, kAnyNumber);
    good &= is_vector;
    if (is_vector && normal == Vec3{})
      good = element.error("A normal can't be [0, 0, 0]; give it any length but zero.");
    if (value.errors().full()) return false;
  }
  return good;
}

Maybe read_mesh(JsonFields& fields) {
  fields.call("a mesh");
  TriangleMesh mesh;
  const auto positions = fields.required("positions"), triangles = fields.required("triangles"),
             normals = fields.optional("normals");
  if (!positions || !triangles) return std::nullopt;
  bool good = read_positions(*positions, mesh.positions);
  if (positions->kind() != JsonKind::array) return std::nullopt;  // indices mean nothing then
  good &= read_triangles(*triangles, mesh.triangles, positions->size());
  if (normals) good &= read_normals(*normals, mesh.normals, positions->size());
  if (!good) return std::nullopt;
  Maybe out(std::in_place);
  out->dropped = drop_unusable_triangles(mesh);
  out->shape = std::move(mesh);
  return out;
}

}  // namespace

std::optional<InlineShape> read_inline_shape(ShapeType type, JsonFields& fields) {
  switch (type) {
    case ShapeType::mesh:
      return read_mesh(fields);
    case ShapeType::sphere:
      return read_sphere(fields);
    case ShapeType::cylinder:
      return read_cylinder(fields);
    case ShapeType::cone:
      return read_cone(fields);
    case ShapeType::disk:
      return read_disk(fields);
    case ShapeType::quad:
      return read_quad(fields);
    case ShapeType::file:
    case ShapeType::instance:
      break;
  }
  return std::nullopt;
}

}  // namespace tessera::proto
