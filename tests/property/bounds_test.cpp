#include <gtest/gtest.h>

#include "core/geometry/shape_outline.h"
#include "core/geometry/triangle.h"
#include "core/scene/scene.h"
#include "tests/property/bound_cases.h"
#include "tests/property/quadric_cases.h"
#include "tests/property/quadric_surface.h"

namespace tessera {
namespace {

/// The laws that core/bounds/bound.h states, for every kind.
template <typename Kind>
class Bounds : public testing::Test {
 public:
  using B = typename Kind::B;
  /// Hulls take some 20 µs a set.
  static constexpr int kSets = std::same_as<Kind, Hulls> ? 20'000 : 100'000;
};
using Kinds = testing::Types<Boxes, Spheres, SlabsOfUsers, Hulls>;
TYPED_TEST_SUITE(Bounds, Kinds);

bool contains(Interval span, float t) { return span.lo <= t && t <= span.hi; }
bool is_miss(Interval span) { return span.lo > span.hi; }

/// 10⁵ sets of boxes, spheres and slabs, 2·10⁴ of hulls.
TYPED_TEST(Bounds, FitContainsEveryPoint_Stress36_Stress37) {
  for (int seed = 0; seed < this->kSets; ++seed) {
    Random random(seed);
    const auto bound = TypeParam::make(random);
    const auto points = make_points(random);
    Outline outline = outline_of(points);
    const auto volume = bound.fit(outline);
    for (const Vec3 p : points) {
      ASSERT_LE(TypeParam::outside(bound, volume, widen(p)), 0) << "seed " << seed;
      ASSERT_TRUE(bound.contains(volume, p)) << "seed " << seed;
    }
  }
}

/// Stretched by up to 1e3 on each axis, turned, mirrored, moved.
Transform make_placement(Random& random) {
  for (;;) {
    const Vec3d x = random.direction(), y = cross(x, random.direction()), z = cross(x, y);
    const Vec3d sx = random.magnitude(-1.5, 1.5) * x, sy = random.magnitude(-1.5, 1.5) * y,
                sz = random.magnitude(-1.5, 1.5) * z;
    const Vec3d at = random.magnitude(-2, 4) * random.in_cube();
    const Vec3d u = random.in_cube(), v = random.in_cube(), w = random.in_cube();
    const auto row = [&](int i) { return sx[i] * u + sy[i] * v + sz[i] * w; };
    const Vec3d a = row(0), b = row(1), c = row(2);
    if (const auto made = Transform::from_rows({a.x, a.y, a.z, at.x, b.x, b.y, b.z, at.y, c.x, c.y, c.z, at.z}))
      return *made;
  }
}

/// Where the placement carries a point, exactly but for 2^-63.
Vec3w placed(const Transform& placement, Vec3w p) {
  const auto& m = placement.rows();
  const auto row = [&](int i) { return m[i] * p.x + m[i + 1] * p.y + m[i + 2] * p.z + m[i + 3]; };
  return {row(0), row(4), row(8)};
}

/// The surface where it is, and where an instance places it.
template <typename Kind, typename Primitive>
void expect_surface_inside(int seed) {
  Random random(seed);
  const auto bound = Kind::make(random);
  const auto primitive = make<Primitive>(random);
  const Object object{0, 0, make_placement(random)};
  Outline local = outline(Shape(primitive)), world = world_outline(object, local);
  const auto around_local = bound.fit(local), around_world = bound.fit(world);
  for (int i = 0; i < 3; ++i) {
    const Vec3w p = point_on(primitive, random);
    ASSERT_LE(Kind::outside(bound, around_local, p), 0) << "seed " << seed;
    ASSERT_LE(Kind::outside(bound, around_world, placed(*object.placement, p)), 0) << "seed " << seed;
  }
}

TYPED_TEST(Bounds, FitContainsEverySurface) {
  for (int seed = 0; seed < this->kSets / 4; ++seed) {
    expect_surface_inside<TypeParam, Sphere>(seed);
    expect_surface_inside<TypeParam, Cone>(seed);
    expect_surface_inside<TypeParam, Cylinder>(seed);
    expect_surface_inside<TypeParam, Disk>(seed);
    if (this->HasFatalFailure()) return;
  }
}

TYPED_TEST(Bounds, FitContainsAnInstanceOfEveryPoint) {
  for (int seed = 0; seed < this->kSets / 10; ++seed) {
    Random random(seed);
    const auto bound = TypeParam::make(random);
    const auto points = make_points(random);
    const Object object{0, 0, make_placement(random)};
    Outline world = world_outline(object, outline_of(points));
    const auto volume = bound.fit(world);
    for (const Vec3 p : points)
      ASSERT_LE(TypeParam::outside(bound, volume, placed(*object.placement, widen(p))), 0) << "seed " << seed;
  }
}

/// As a hierarchy does on its way up: outlines that were thinned below decide the volume above.
TYPED_TEST(Bounds, FitToThinnedOutlinesContainsWhatTheyCameFrom) {
  for (int seed = 0; seed < this->kSets / 10; ++seed) {
    Random random(seed);
    const auto bound = TypeParam::make(random);
    const Vec3d offset = random.bits() % 2 ? random.magnitude(-3, 6) * random.in_cube() : Vec3d{};
    std::vector<Vec3> all;
    Outline upper;
    for (int part = 0; part < 3; ++part) {
      std::vector<Vec3> points;
      for (const Vec3d p : make_shape(random)) points.push_back(to_float(p + offset));
      Outline lower = outline_of(points);
      bound.fit(lower);
      upper.append(lower);
      all.insert(all.end(), points.begin(), points.end());
      const auto volume = bound.fit(upper);
      for (const Vec3 p : all) ASSERT_LE(TypeParam::outside(bound, volume, widen(p)), 0) << "seed " << seed;
    }
  }
}

/// Balls and disks about as large as the floats around them are apart, and points as near to them as floats can be:
/// samples of such surfaces round to where the surfaces aren't. Fitted, thinned, put together and fitted again.
TYPED_TEST(Bounds, FitContainsPointsAndRoundShapesThatAreFar) {
  for (int seed = 0; seed < this->kSets / 10; ++seed) {
    Random random(seed);
    const auto bound = TypeParam::make(random);
    const Vec3d places[] = {{1e6, 0, 0}, {1e6, 1e6, 0}, {1e6, -1e6, 1e6}, 1e6 * random.in_cube()};
    const Vec3d offset = places[random.bits() % 4];
    std::vector<Vec3w> held;
    Outline upper;
    for (int part = 0; part < 3; ++part) {
      const auto radius = static_cast<float>(random.magnitude(-1.5, 0));
      const Vec3 center = to_float(offset + 0.2 * random.in_cube());
      const Sphere sphere{center, radius};
      const Disk disk{center, *UnitVec3::normalize(random.direction()), radius};
      const bool is_round = random.bits() % 2;
      Outline lower = is_round ? outline(Shape(sphere)) : outline(Shape(disk));
      for (int i = 0; i < 6; ++i) {
        const Vec3w p = is_round ? point_on(sphere, random) : point_on(disk, random);
        held.push_back(p);
        if (random.bits() % 2) continue;
        lower.points.push_back(Vec3{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
        held.push_back(widen(lower.points.back()));
      }
      bound.fit(lower);
      upper.append(lower);
      const auto volume = bound.fit(upper);
      for (const Vec3w& p : held) ASSERT_LE(TypeParam::outside(bound, volume, p), 0) << "seed " << seed;
    }
  }
}

TYPED_TEST(Bounds, JoinContainsBoth) {
  for (int seed = 0; seed < this->kSets; ++seed) {
    Random random(seed);
    const auto bound = TypeParam::make(random);
    const auto a = make_points(random), b = make_points(random);
    Outline oa = outline_of(a), ob = outline_of(b);
    const auto va = bound.fit(oa), vb = bound.fit(ob);
    const auto both = bound.join(va, vb);
    for (const auto& points : {a, b})
      for (const Vec3 p : points) ASSERT_LE(TypeParam::outside(bound, both, widen(p)), 0) << "seed " << seed;
    EXPECT_GE(bound.cost(both), std::max(bound.cost(va), bound.cost(vb)) * (1 - 1e-6)) << "seed " << seed;
  }
}

TYPED_TEST(Bounds, JoinWithNothingChangesNothing) {
  for (int seed = 0; seed < 1000; ++seed) {
    Random random(seed);
    const auto bound = TypeParam::make(random);
    const auto points = make_points(random);
    Outline outline = outline_of(points), none;
    const auto volume = bound.fit(outline), nothing = bound.fit(none);
    for (const auto& both : {bound.join(volume, nothing), bound.join(nothing, volume)}) {
      EXPECT_DOUBLE_EQ(bound.cost(both), bound.cost(volume)) << "seed " << seed;
      for (const Vec3 p : points) ASSERT_TRUE(bound.contains(both, p)) << "seed " << seed;
    }
  }
}

TYPED_TEST(Bounds, NoRayHitsNothing) {
  for (int seed = 0; seed < 1000; ++seed) {
    Random random(seed);
    const auto bound = TypeParam::make(random);
    const Aabb reach = box_of(make_points(random));
    Outline none;
    const auto nothing = bound.fit(none);
    const Ray ray{to_float(random.in_cube()), to_float(random.direction())};
    EXPECT_TRUE(is_miss(bound.clipper(ray, reach).clip(nothing))) << "seed " << seed;
    EXPECT_FALSE(bound.contains(nothing, ray.origin)) << "seed " << seed;
    EXPECT_EQ(bound.cost(nothing), 0) << "seed " << seed;
  }
}

/// Any three points as triangles. Rays at points, edges, insides and past them, of any length.
TYPED_TEST(Bounds, ClipLosesNoHitOnATriangle) {
  int hits = 0, culled = 0;
  for (int seed = 0; seed < this->kSets; ++seed) {
    Random random(seed);
    const auto bound = TypeParam::make(random);
    const auto points = make_points(random);
    if (points.size() < 3) continue;
    Outline outline = outline_of(points);
    const auto volume = bound.fit(outline);
    const Aabb box = box_of(points);

    const auto corner = [&] { return to_double(points[random.bits() % points.size()]); };
    const Vec3d a = corner(), b = corner(), c = corner();
    const double s = random.uniform(-0.2, 1.2), t = random.bits() % 3 ? random.uniform(-0.2, 1.2) : 0;
    const Vec3d target = a + s * (b - a) + t * (c - a);
    const double size = std::max<double>(max_component(box.diagonal()), 1e-7 * max_component(abs(target)));
    if (size == 0) continue;
    const Vec3 origin = to_float(target + size * random.magnitude(-2, 7) * random.direction());
    const Vec3d d = target - to_double(origin);
    const double scale = random.magnitude(-18, 18);
    const Ray ray{origin, to_float((scale / length(d)) * d)};
    if (!is_traceable(ray) || size / scale < 1e-30 || size / scale > 1e25) continue;

    const Interval span = bound.clipper(ray, box).clip(volume);
    culled += is_miss(span);
    const TriangleRay sheared(ray);
    for (std::size_t i = 0; i + 2 < points.size(); ++i) {
      const std::array triangle{points[i], points[i + 1], points[i + 2]};
      const auto hit = intersect_triangle(sheared, triangle[0], triangle[1], triangle[2]);
      if (!hit) continue;
      // Also where the triangle is a line to the ray, or nearly so.
      ASSERT_LE(distance(triangle, point_at(ray, *hit)), 4 * kUnitRoundoff * reach(box, ray)) << "seed " << seed;
      ++hits;
      ASSERT_TRUE(contains(span, *hit)) << "seed " << seed << " t " << *hit << " in " << span.lo << " " << span.hi;
    }
  }
  EXPECT_GT(hits, this->kSets / 4);
  EXPECT_GT(culled, this->kSets / 100);
}

/// What rays came to: a test without either would say nothing.
struct Seen {
  int hits = 0, culled = 0;
};

template <typename Kind, typename Primitive>
void expect_no_hit_lost(int seed, Seen& seen) {
  Random random(seed);
  const auto bound = Kind::make(random);
  const auto primitive = make<Primitive>(random);
  Outline local = outline(Shape(primitive));
  const auto volume = bound.fit(local);
  const Aabb box = bounds(primitive);
  Ray ray = make_ray(random, box);
  if (random.bits() % 2) {
    const auto [point, direction] = awkward_line(primitive, random);
    if (length(direction) > 0)
      ray = {
          to_float(point - random.magnitude(-3, 4) * length(to_double(box.diagonal())) / length(direction) * direction),
          to_float(direction / length(direction))};
  }
  const Interval span = bound.clipper(ray, box).clip(volume);
  seen.culled += is_miss(span);
  while (const auto t = intersect(primitive, ray)) {
    ++seen.hits;
    ASSERT_TRUE(contains(span, *t)) << "seed " << seed << " t " << *t << " in " << span.lo << " " << span.hi;
    ray.t_min = *t;
  }
}

TYPED_TEST(Bounds, ClipLosesNoHitOnAQuadric) {
  Seen spheres, cones, cylinders, disks;
  for (int seed = 0; seed < this->kSets / 4; ++seed) {
    expect_no_hit_lost<TypeParam, Sphere>(seed, spheres);
    expect_no_hit_lost<TypeParam, Cone>(seed, cones);
    expect_no_hit_lost<TypeParam, Cylinder>(seed, cylinders);
    expect_no_hit_lost<TypeParam, Disk>(seed, disks);
  }
  for (const Seen& seen : {spheres, cones, cylinders, disks}) {
    EXPECT_GT(seen.hits, this->kSets / 100);
    EXPECT_GT(seen.culled, 0);
  }
}

/// Instances: hits are found in the shape's space, and bounded in the world.
TYPED_TEST(Bounds, ClipLosesNoHitOnAnInstance) {
  Seen seen;
  for (int seed = 0; seed < this->kSets / 4; ++seed) {
    Random random(seed);
    const auto bound = TypeParam::make(random);
    const Object object{0, 0, make_placement(random)};
    Shape shape = Cylinder{to_float(random.in_cube()), to_float(random.in_cube()), 0.5F};
    switch (random.bits() % 3) {
      case 0:
        shape = Sphere{to_float(random.in_cube()), 0.5F};
        break;
      case 1:
        shape = Quad{{to_float(random.in_cube()), to_float(random.in_cube()), to_float(random.in_cube()),
                      to_float(random.in_cube())}};
        break;
      default:
        break;
    }
    Outline world = world_outline(object, outline(shape)), same = world;
    const Aabb box = BoxBound().fit(same);
    const auto volume = bound.fit(world);
    const Ray ray = make_ray(random, box), local = object.placement->to_local(ray);
    const Interval span = bound.clipper(ray, box, object.placement->error()).clip(volume);
    seen.culled += is_miss(span);
    const auto t = intersect_single(shape, local);
    if (!t) continue;
    ++seen.hits;
    ASSERT_TRUE(contains(span, *t)) << "seed " << seed << " t " << *t << " in " << span.lo << " " << span.hi;
  }
  EXPECT_GT(seen.hits, this->kSets / 100);
  EXPECT_GT(seen.culled, 0);
}

}  // namespace
}  // namespace tessera
