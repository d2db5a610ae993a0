#include "core/light/emissive_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/geometry/triangle.h"
#include "core/light/spherical_triangle.h"
#include "core/math/portable_float.h"
#include "core/sampling/warp.h"

namespace tessera {
namespace {

constexpr double kPi = std::numbers::pi;

/// The linear part of a placement, by columns.
struct Columns {
  Vec3d x, y, z;

  explicit Columns(const Transform& placement) {
    const auto& m = placement.rows();
    x = {m[0], m[4], m[8]};
    y = {m[1], m[5], m[9]};
    z = {m[2], m[6], m[10]};
  }
  double determinant() const { return dot(x, cross(y, z)); }
  Vec3d operator()(Vec3d v) const { return x * v.x + y * v.y + z * v.z; }
};

Vec3d point_to_world(const Object& object, Vec3 local) {
  const Vec3d p = to_double(local);
  return object.placement ? object.placement->point_to_world(p) : p;
}

/// A flat piece of surface in the world: a triangle, or a disk by its centre and two radii.
struct Flat {
  Vec3d start, first, second;
  Vec3d cross;  ///< first × second, on the outer side.

  Flat(const Object& object, Vec3d at, Vec3d to_first, Vec3d to_second)
      : start(at), first(to_first), second(to_second), cross(tessera::cross(first, second)) {
    if (object.placement && Columns(*object.placement).determinant() < 0) cross = -cross;
  }
};

Flat triangle(const Object& object, Vec3 a, Vec3 b, Vec3 c) {
  std::array<Vec3d, 3> at{to_double(a), to_double(b), to_double(c)};
  if (object.placement) {
    const Transform::ToWorld to_world = object.placement->to_world();
    for (Vec3d& corner : at) corner = to_world.point(corner);
  }
  return {object, at[0], at[1] - at[0], at[2] - at[0]};
}

Flat triangle(const Object& object, const TriangleMesh& mesh, std::uint32_t primitive) {
  const TriangleIndices& i = mesh.triangles[primitive];
  return triangle(object, mesh.positions[i[0]], mesh.positions[i[1]], mesh.positions[i[2]]);
}

/// `WorldTriangle`s are wound outward.
Flat flat_of(const WorldTriangle& corners) {
  const Vec3d start = to_double(corners[0]);
  return {Object{}, start, to_double(corners[1]) - start, to_double(corners[2]) - start};
}

struct Halves {
  Flat first, second;
  double first_area, area;  ///< Twice.

  Halves(const Object& object, const Quad& quad)
      : first(triangle(object, quad.corners[0], quad.corners[1], quad.corners[2])),
        second(triangle(object, quad.corners[0], quad.corners[2], quad.corners[3])),
        first_area(length(first.cross)),
        area(first_area + length(second.cross)) {}
};

Flat flat_disk(const Object& object, const Disk& disk) {
  const Basis basis = basis_around(disk.normal);
  const double radius = disk.radius;
  Vec3d x = to_double(basis.x) * radius, y = to_double(basis.y) * radius;
  if (object.placement) {
    const Columns to_world(*object.placement);
    x = to_world(x);
    y = to_world(y);
  }
  return {object, point_to_world(object, disk.center), x, y};
}

/// A sphere that is still one in the world.
struct Ball {
  Vec3d center;
  double radius;
};

/// Nothing when the placement makes an ellipsoid of it, beyond what its own rounding does.
std::optional<Ball> ball(const Object& object, const Sphere& sphere) {
  const Vec3d center = point_to_world(object, sphere.center);
  if (!object.placement) return Ball{center, sphere.radius};
  constexpr double kRounding = 0x1p-19;
  const Columns m(*object.placement);
  const double square = dot(m.x, m.x), most = kRounding * square;
  if (std::abs(dot(m.y, m.y) - square) > most || std::abs(dot(m.z, m.z) - square) > most ||
      std::abs(dot(m.x, m.y)) > most || std::abs(dot(m.y, m.z)) > most || std::abs(dot(m.z, m.x)) > most)
    return std::nullopt;
  return Ball{center, sphere.radius * std::sqrt(square)};
}

/// From points so little outside of a ball it is seen as from inside. Those of its own surface are among them, which
/// are off it by roundings: they see nothing of it but its inside.
constexpr double kTouching = 1 + 0x1p-16;

/// What lies nearer than this share of its radius isn't sampled from inside: a ray that leaves a point of the surface
/// for the outside seems to meet it there.
constexpr double kTooNear = 0x1p-8;

/// The cone that a ball fills, as `uniform_cone` takes it; nothing from inside.
std::optional<double> one_minus_cos(const Ball& ball, Vec3d from) {
  const Vec3d way = ball.center - from;
  const double square = dot(way, way), inside = ball.radius * ball.radius;
  if (!(square > inside * kTouching)) return std::nullopt;
  const double sine = inside / square;  // squared
  return sine / (1 + std::sqrt(1 - sine));
}

/// How much larger an ellipsoid's area is than its sphere's, where the ellipsoid's unit normal is `normal`.
double area_stretch(const Columns& m, Vec3d normal) {
  const Vec3d transposed{dot(m.x, normal), dot(m.y, normal), dot(m.z, normal)};
  return std::abs(m.determinant()) / length(transposed);
}

/// Whether a point, seen from an ellipsoid's centre, is inside or touches it.
bool is_inside(Vec3d point, const Columns& m, double radius) {
  const Vec3d local{dot(point, cross(m.y, m.z)), dot(point, cross(m.z, m.x)), dot(point, cross(m.x, m.y))};
  return length(local) <= radius * kTouching * std::abs(m.determinant());
}

std::optional<SurfaceSample> checked(const SurfaceSample& sample) {
  if (!(sample.pdf > 0) || !std::isfinite(sample.pdf)) return std::nullopt;
  return sample;
}

/// `area` is that which the point is chosen from, as a multiple of the flat's `cross`.
std::optional<SurfaceSample> toward(const Flat& flat, Vec3d way, double area) {
  const double along = dot(flat.cross, way), square = dot(way, way);
  return checked({way, along < 0, square * std::sqrt(square) / (std::abs(along) * area)});
}

/// A triangle's area, of `cross`.
constexpr double kHalf = 0.5;

std::optional<SphericalTriangle> seen(const Flat& triangle, Vec3d from) {
  const Vec3d a = triangle.start - from;
  return SphericalTriangle::seen(a, a + triangle.first, a + triangle.second);
}

/// The point of a flat in a direction.
std::optional<SurfaceSample> along(const Flat& flat, Vec3d from, Vec3d direction, double pdf) {
  const double facing = dot(flat.cross, direction);
  const Vec3d way = direction * (dot(flat.cross, flat.start - from) / facing);
  return checked({way, facing < 0, pdf});
}

std::optional<SurfaceSample> sample_triangle(const Flat& flat, Vec3d from, Vec2 u, double area) {
  const Vec2 share = uniform_triangle(u);
  return toward(flat, flat.start - from + flat.first * share.x + flat.second * share.y, area);
}

std::optional<SurfaceSample> sample_triangle(const Flat& flat, Vec3d from, Vec2 u) {
  if (const auto triangle = seen(flat, from))
    return along(flat, from, triangle->sample(u), 1 / triangle->solid_angle());
  return sample_triangle(flat, from, u, kHalf);
}

std::optional<SurfaceSample> sample(const Object& object, const TriangleMesh& mesh, std::uint32_t primitive, Vec3d from,
                                    Vec2 u) {
  return sample_triangle(triangle(object, mesh, primitive), from, u);
}

/// Both halves of a quad, where they lie side by side.
struct SeenQuad {
  SphericalTriangle first, second;

  double solid_angle() const { return first.solid_angle() + second.solid_angle(); }
};

std::optional<SeenQuad> seen(const Halves& halves, Vec3d from) {
  constexpr double kFlat = 1 - 0x1p-20;
  const double second_area = halves.area - halves.first_area;
  if (!(dot(halves.first.cross, halves.second.cross) >= kFlat * halves.first_area * second_area)) return std::nullopt;
  const auto first = seen(halves.first, from);
  if (!first) return std::nullopt;
  const auto second = seen(halves.second, from);
  if (!second) return std::nullopt;
  return SeenQuad{*first, *second};
}

std::optional<SurfaceSample> sample(const Object& object, const Quad& quad, std::uint32_t, Vec3d from, Vec2 u) {
  const Halves halves(object, quad);
  if (const auto quad_seen = seen(halves, from)) {
    const double whole = quad_seen->solid_angle(), share = quad_seen->first.solid_angle() / whole;
    const bool first = u.x < share;
    u.x = below_one(first ? u.x / share : (u.x - share) / (1 - share));
    return along(first ? halves.first : halves.second, from,
                 first ? quad_seen->first.sample(u) : quad_seen->second.sample(u), 1 / whole);
  }
  const double share = halves.first_area / halves.area;
  if (u.x < share) return sample_triangle(halves.first, from, {static_cast<float>(u.x / share), u.y}, kHalf / share);
  return sample_triangle(halves.second, from, {static_cast<float>((u.x - share) / (1 - share)), u.y},
                         kHalf / (1 - share));
}

std::optional<SurfaceSample> sample(const Object& object, const Disk& disk, std::uint32_t, Vec3d from, Vec2 u) {
  const Flat flat = flat_disk(object, disk);
  const Vec2 at = uniform_disk(u);
  return toward(flat, flat.start - from + flat.first * at.x + flat.second * at.y, kPi);
}

std::optional<SurfaceSample> sample_ball(const Ball& ball, Vec3d from, Vec2 u) {
  const Vec3d way = ball.center - from;
  const double distance = length(way);
  const auto cone = one_minus_cos(ball, from);
  if (!cone) {
    const Vec3d direction = to_double(uniform_sphere(u));
    const double closest = dot(way, direction), rest = ball.radius * ball.radius - dot(way, way);
    const double t = closest + std::sqrt(std::max(0.0, closest * closest + rest));
    if (!(t > kTooNear * ball.radius)) return std::nullopt;
    return checked({direction * t, false, kUniformSpherePdf});
  }
  const Vec2 disk = uniform_disk(u);
  const double height = (double{disk.x} * disk.x + double{disk.y} * disk.y) * *cone;
  const double sine = std::sqrt(height * (2 - height)), spread = std::sqrt(*cone * (2 - height));
  const Vec3d axis = way / distance;
  const Basis basis = basis_around(to_float(axis));
  const Vec3d direction =
      axis * (1 - height) + to_double(basis.x) * (disk.x * spread) + to_double(basis.y) * (disk.y * spread);
  const double closest = distance * (1 - height), across = distance * sine;
  const double half_chord = std::sqrt(std::max(0.0, (ball.radius - across) * (ball.radius + across)));
  const double t = (distance - ball.radius) * (distance + ball.radius) / (closest + half_chord);
  return checked({direction * t, true, 1 / (2 * kPi * *cone)});
}

std::optional<SurfaceSample> sample(const Object& object, const Sphere& sphere, std::uint32_t, Vec3d from, Vec2 u) {
  if (const auto round = ball(object, sphere)) return sample_ball(*round, from, u);
  const Columns m(*object.placement);
  const Vec3d local = to_double(uniform_sphere(u));
  const double radius = sphere.radius;
  const Vec3d scaled = object.placement->normal_to_world(local), normal = scaled / length(scaled);
  const Vec3d from_center = m(local * radius), way = point_to_world(object, sphere.center) + from_center - from;
  const double along = dot(normal, way), square = dot(way, way);
  const bool front = along < 0;
  if (front == is_inside(from_center - way, m, radius)) return std::nullopt;  // behind what is nearer
  return checked(
      {way, front,
       square * std::sqrt(square) / (std::abs(along) * area_stretch(m, normal) * 4 * kPi * radius * radius)});
}

std::optional<SurfaceSample> sample(const Object&, const Cylinder&, std::uint32_t, Vec3d, Vec2) { return std::nullopt; }
std::optional<SurfaceSample> sample(const Object&, const Cone&, std::uint32_t, Vec3d, Vec2) { return std::nullopt; }

/// The area that points are chosen from evenly, where its normal is `normal`; nothing for what isn't chosen by area.
double area(const Object& object, const TriangleMesh& mesh, std::uint32_t primitive, Vec3d) {
  return length(triangle(object, mesh, primitive).cross) / 2;
}
double area(const Object& object, const Quad& quad, std::uint32_t, Vec3d) { return Halves(object, quad).area / 2; }
double area(const Object& object, const Disk& disk, std::uint32_t, Vec3d) {
  return kPi * length(flat_disk(object, disk).cross);
}
double area(const Object& object, const Sphere& sphere, std::uint32_t, Vec3d normal) {
  return 4 * kPi * sphere.radius * sphere.radius * area_stretch(Columns(*object.placement), normal);
}
double area(const Object&, const Cylinder&, std::uint32_t, Vec3d) { return kInfinity; }
double area(const Object&, const Cone&, std::uint32_t, Vec3d) { return kInfinity; }

void extend(Vec3d& lo, Vec3d& hi, Vec3d p) {
  lo = min(lo, p);
  hi = max(hi, p);
}

Aabb box_of(const Flat& triangle) {
  Vec3d lo = triangle.start, hi = lo;
  extend(lo, hi, triangle.start + triangle.first);
  extend(lo, hi, triangle.start + triangle.second);
  return outward(lo, hi);
}

/// Whether there is more of it than what the cross product's rounding may make of nothing.
bool has_area(const Flat& flat) { return length(flat.cross) > 0x1p-48 * (length(flat.first) * length(flat.second)); }

LightBounds flat_bounds(const Flat& flat, const Aabb& box, double area) {
  if (!has_area(flat)) return {.box = box};
  return {box, *UnitVec3::normalize(flat.cross), 1, 0, false, area};
}

LightBounds bounds(const Object& object, const TriangleMesh& mesh, std::uint32_t primitive) {
  const Flat flat = triangle(object, mesh, primitive);
  return flat_bounds(flat, box_of(flat), length(flat.cross) / 2);
}

LightBounds bounds(const Object& object, const Quad& quad, std::uint32_t) {
  const Halves halves(object, quad);
  LightBounds first = flat_bounds(halves.first, box_of(halves.first), 1);
  const LightBounds second = flat_bounds(halves.second, box_of(halves.second), 1);
  EmissionCone cone = EmissionCone::around(halves.first.cross + halves.second.cross);
  for (const LightBounds& half : {first, second})
    if (half.intensity > 0) cone.extend(half);
  first.box.extend(second.box);
  const bool any = has_area(halves.first) || has_area(halves.second);
  return {first.box, to_float(cone.axis), static_cast<float>(cone.cos_spread), 0, false, any ? halves.area / 2 : 0};
}

LightBounds bounds(const Object& object, const Disk& disk, std::uint32_t) {
  const Flat flat = flat_disk(object, disk);
  Vec3d reach;
  for (int i = 0; i < 3; ++i) reach[i] = std::sqrt(flat.first[i] * flat.first[i] + flat.second[i] * flat.second[i]);
  return flat_bounds(flat, outward(flat.start - reach, flat.start + reach), kPi * length(flat.cross));
}

LightBounds bounds(const Object& object, const Sphere& sphere, std::uint32_t) {
  const Vec3d center = point_to_world(object, sphere.center);
  const double radius = sphere.radius;
  Vec3d reach{radius, radius, radius};
  double cross_section = kPi * radius * radius;
  if (object.placement) {
    const Columns m(*object.placement);
    for (int i = 0; i < 3; ++i) reach[i] = radius * std::sqrt(m.x[i] * m.x[i] + m.y[i] * m.y[i] + m.z[i] * m.z[i]);
    cross_section *= (length(cross(m.x, m.y)) + length(cross(m.y, m.z)) + length(cross(m.z, m.x))) / 3;
  }
  return {.box = outward(center - reach, center + reach), .intensity = cross_section};
}

LightBounds bounds(const Object&, const Cylinder&, std::uint32_t) { return {}; }
LightBounds bounds(const Object&, const Cone&, std::uint32_t) { return {}; }

std::optional<float> t_near_one(const Quad& quad, const Ray& ray) {
  const TriangleRay sheared(ray);
  const auto& [a, b, c, d] = quad.corners;
  const auto first = intersect_triangle(sheared, a, b, c), second = intersect_triangle(sheared, a, c, d);
  if (!first || !second) return first ? first : second;
  return std::abs(*first - 1) < std::abs(*second - 1) ? first : second;
}

}  // namespace

bool can_be_sampled(const Shape& shape) {
  if (const auto* quad = std::get_if<Quad>(&shape)) {
    const Halves halves(Object{}, *quad);
    return dot(halves.first.cross, halves.second.cross) >= 0;
  }
  return !std::holds_alternative<Cylinder>(shape) && !std::holds_alternative<Cone>(shape);
}

std::optional<SurfaceSample> sample_surface(const Scene& scene, PrimitiveId primitive, Vec3d from, Vec2 u) {
  const Object& object = scene.objects[primitive.object];
  return std::visit([&](const auto& shape) { return sample(object, shape, primitive.primitive, from, u); },
                    scene.shapes[object.shape]);
}

WorldTriangle world_triangle(const Object& object, const TriangleMesh& mesh, std::uint32_t primitive) {
  const TriangleIndices& i = mesh.triangles[primitive];
  WorldTriangle corners;
  for (int c = 0; c < 3; ++c) corners[c] = to_float(point_to_world(object, mesh.positions[i[c]]));
  if (object.placement && Columns(*object.placement).determinant() < 0) std::swap(corners[1], corners[2]);
  return corners;
}

std::optional<SurfaceSample> sample_surface(const WorldTriangle& triangle, Vec3d from, Vec2 u) {
  return sample_triangle(flat_of(triangle), from, u);
}

double surface_pdf(const WorldTriangle& corners, Vec3d from, Vec3 direction, double distance) {
  const Flat flat = flat_of(corners);
  if (const auto triangle = seen(flat, from)) return 1 / triangle->solid_angle();
  const double pdf = distance * distance / (std::abs(dot(to_double(direction), flat.cross)) / 2);
  return std::isfinite(pdf) ? pdf : 0;
}

std::optional<float> t_before(const WorldTriangle& triangle, const Ray& ray, double error) {
  const Flat flat = flat_of(triangle);
  const double along = dot(flat.cross, to_double(ray.direction));
  const double t = dot(flat.cross, flat.start - to_double(ray.origin)) / along;
  const double doubt = error * length(flat.cross) / std::abs(along);
  constexpr double kFar = 0.01, kMuch = 0x1p-18;
  if (!(std::abs(t - 1) <= kFar && doubt <= kMuch)) return std::nullopt;
  return static_cast<float>(t - doubt);
}

double surface_pdf(const Scene& scene, PrimitiveId primitive, Vec3d from, Vec3 direction, double distance,
                   Vec3d normal) {
  const Object& object = scene.objects[primitive.object];
  const Shape& shape = scene.shapes[object.shape];
  const bool front = dot(to_double(direction), normal) < 0;
  if (const auto* sphere = std::get_if<Sphere>(&shape)) {
    if (const auto round = ball(object, *sphere)) {
      if (const auto cone = one_minus_cos(*round, from)) return front ? 1 / (2 * kPi * *cone) : 0;
      return !front && distance > kTooNear * round->radius ? kUniformSpherePdf : 0;
    }
    const Vec3d from_center = from - point_to_world(object, sphere->center);
    if (front == is_inside(from_center, Columns(*object.placement), sphere->radius)) return 0;
  }
  if (const auto* quad = std::get_if<Quad>(&shape))
    if (const auto quad_seen = seen(Halves(object, *quad), from)) return 1 / quad_seen->solid_angle();
  if (const auto* mesh = std::get_if<TriangleMesh>(&shape))
    if (const auto triangle_seen = seen(triangle(object, *mesh, primitive.primitive), from))
      return 1 / triangle_seen->solid_angle();
  const double from_area =
      std::visit([&](const auto& s) { return area(object, s, primitive.primitive, normal); }, shape);
  const double pdf = distance * distance / (std::abs(dot(to_double(direction), normal)) * from_area);
  return std::isfinite(pdf) ? pdf : 0;
}

LightBounds surface_bounds(const Scene& scene, PrimitiveId primitive, double radiance, bool both_sides) {
  const Object& object = scene.objects[primitive.object];
  LightBounds out = std::visit([&](const auto& shape) { return bounds(object, shape, primitive.primitive); },
                               scene.shapes[object.shape]);
  out.intensity *= radiance;
  out.both_sides = both_sides;
  return out;
}

std::optional<float> t_near_one(const Scene& scene, PrimitiveId primitive, const Ray& ray) {
  const Object& object = scene.objects[primitive.object];
  const Shape& shape = scene.shapes[object.shape];
  const Ray local = object.placement ? object.placement->to_local(ray) : ray;
  if (const auto* mesh = std::get_if<TriangleMesh>(&shape)) {
    const TriangleIndices& i = mesh->triangles[primitive.primitive];
    return intersect_triangle(TriangleRay(local), mesh->positions[i[0]], mesh->positions[i[1]], mesh->positions[i[2]]);
  }
  if (const auto* quad = std::get_if<Quad>(&shape)) return t_near_one(*quad, local);
  return intersect_single(shape, local);
}

}  // namespace tessera
