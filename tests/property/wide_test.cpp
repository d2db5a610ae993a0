// Law L1 for the wide kernels: every instruction set, alone or with others, gives a ray the hit of brute force.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "core/accel/wide/wide_accel.h"
#include "core/accel/wide/wide_build.h"
#include "core/integrator/spawn.h"
#include "tests/property/closed_meshes.h"
#include "tests/property/mesh_parts.h"
#include "tests/support/effort.h"
#include "tests/support/image.h"
#include "tests/support/same_hits.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

/// Number of the object that the mesh is taken to be, so that others come before it and after it.
constexpr std::uint32_t kObject = 5;

/// Rays of one kind, and what brute force makes of them.
struct Rays {
  std::string name;
  std::vector<Ray> rays;
  std::optional<Vec3> from = {}, to = {};  ///< The point that they all leave, or lead to.
  std::vector<std::optional<Hit>> hits = {};
};

/// A mesh, and rays that give trouble in it.
class Case {
 public:
  Case(std::string name, TriangleMesh mesh, std::uint64_t seed)
      : name_(std::move(name) + ", seed " + std::to_string(seed)), mesh_(std::move(mesh)), random_(seed) {
    drop_unusable_triangles(mesh_);
    for (const TriangleIndices& t : mesh_.triangles)
      for (const std::uint32_t corner : t) box_.extend(mesh_.positions[corner]);
    size_ = std::max(1e-44, double{max_component(box_.diagonal())});
  }

  void expect_agreement(int sets) {
    const auto scene = SceneBuilder().add(mesh_).build();
    const auto brute = make_accel(scene, {AccelKind::brute});
    const WideTree tree = build_wide(mesh_);
    std::vector<Rays> all = make_rays(sets);
    for (int i = 0; i < sets && !mesh_.triangles.empty(); ++i) {
      all.push_back(leaving(*scene, *brute, false));
      all.push_back(leaving(*scene, *brute, true));
    }
    for (Rays& set : all) {
      std::erase_if(set.rays, [](const Ray& ray) { return !is_traceable(ray); });
      for (const Ray& ray : set.rays) {
        set.hits.push_back(brute->closest(ray));
        if (set.hits.back()) set.hits.back()->object = kObject;
      }
      for (const WideKernels* kernels : runnable_wide_kernels()) {
        SCOPED_TRACE(name_ + ", " + set.name + ", " + kernels->name);
        expect_closest(*kernels, tree, set);
        expect_occluded(*kernels, tree, set);
        if (testing::Test::HasFailure()) return;
      }
    }
  }

  /// Fans that a picture could hold.
  int pictures() const { return pictures_; }
  int hits() const { return hits_; }

 private:
  static Hit or_none(const std::optional<Hit>& hit) { return hit.value_or(Hit{}); }

  /// What is known before the mesh is searched: nothing, as most often, or for some rays hits of others nearby.
  std::vector<Hit> known_before(const Rays& set) {
    std::vector<Hit> hits(set.rays.size());
    if (random_.bits() % 2 == 0) return hits;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const std::uint64_t kind = random_.bits() % 8;
      if (!set.hits[i] || kind > 4) continue;
      const float t = set.hits[i]->t;
      const float near = kind == 0 ? std::nextafter(t, 0.0F) : kind == 1 ? std::nextafter(t, kInfinity) : t;
      hits[i] = {near, kObject + static_cast<std::uint32_t>(kind) - 3, static_cast<std::uint32_t>(random_.bits() % 9)};
    }
    return hits;
  }

  void expect_closest(const WideKernels& kernels, const WideTree& tree, const Rays& set) {
    using Search = std::function<void(std::span<const Ray>, std::span<Hit>, TestCounts*)>;
    const Search stream = [&](auto rays, auto hits, auto* counts) {
      kernels.closest(tree, kObject, rays, hits, counts);
    };
    const Search single = [&](auto rays, auto hits, auto* counts) {
      for (std::size_t i = 0; i < rays.size(); ++i)
        kernels.closest(tree, kObject, rays.subspan(i, 1), hits.subspan(i, 1), counts);
    };
    const Search fan = [&](auto rays, auto hits, auto* counts) {
      Directions directions;
      directions.append_those_of(rays);
      for (std::size_t i = 0; i < rays.size(); i += kFanRays) {
        const std::size_t n = std::min(kFanRays, rays.size() - i);
        const RayFan some = RayFan(*set.from, directions).part(i, n);
        const bool done = kernels.closest_fan(tree, kObject, some, hits.subspan(i, n), counts);
        if (!done) stream(rays.subspan(i, n), hits.subspan(i, n), counts);
        pictures_ += done;
      }
    };
    const auto check = [&](const char* way, const Search& search, TestCounts* counts) {
      std::vector<Hit> hits = known_before(set);
      const std::vector<Hit> before = hits;
      search(set.rays, hits, counts);
      for (std::size_t i = 0; i < hits.size(); ++i) {
        ASSERT_EQ(hits[i], std::min(before[i], or_none(set.hits[i]))) << way << ", " << tell(set.rays[i]);
        hits_ += hits[i] != before[i];
      }
    };
    TestCounts counts;
    check("single", single, nullptr);
    check("stream", stream, nullptr);
    check("single, counted", single, &counts);
    check("stream, counted", stream, &counts);
    if (set.from) check("fan", fan, nullptr);
    if (set.from) check("fan, counted", fan, &counts);
  }

  void expect_occluded(const WideKernels& kernels, const WideTree& tree, const Rays& set) {
    const auto check = [&](const char* way, auto&& search, TestCounts* counts) {
      std::vector<std::uint8_t> hidden(set.rays.size());
      for (std::uint8_t& is_hidden : hidden) is_hidden = random_.bits() % 16 == 0;
      const std::vector<std::uint8_t> before = hidden;
      search(std::span(set.rays), std::span(hidden), counts);
      for (std::size_t i = 0; i < hidden.size(); ++i)
        ASSERT_EQ(hidden[i], before[i] | set.hits[i].has_value()) << way << ", " << tell(set.rays[i]);
    };
    const auto stream = [&](auto rays, auto hidden, TestCounts* counts) {
      kernels.occluded(tree, kObject, rays, hidden, counts);
    };
    const auto single = [&](auto rays, auto hidden, TestCounts* counts) {
      for (std::size_t i = 0; i < rays.size(); ++i) stream(rays.subspan(i, 1), hidden.subspan(i, 1), counts);
    };
    const auto fan = [&](auto rays, auto hidden, TestCounts* counts) {
      for (std::size_t i = 0; i < rays.size(); i += kFanRays) {
        const std::size_t n = std::min(kFanRays, rays.size() - i);
        const bool done =
            kernels.occluded_fan(tree, kObject, *set.to, rays.subspan(i, n), hidden.subspan(i, n), counts);
        if (!done) stream(rays.subspan(i, n), hidden.subspan(i, n), counts);
        pictures_ += done;
      }
    };
    TestCounts counts;
    check("any, single", single, nullptr);
    check("any, stream", stream, nullptr);
    check("any, stream, counted", stream, &counts);
    if (set.to) check("any, fan", fan, nullptr);
    if (set.to) check("any, fan, counted", fan, &counts);
  }

  static std::string tell(const Ray& ray) {
    std::array<char, 400> text;
    std::snprintf(text.data(), text.size(), "from (%a %a %a) along (%a %a %a), %a to %a", ray.origin.x, ray.origin.y,
                  ray.origin.z, ray.direction.x, ray.direction.y, ray.direction.z, ray.t_min, ray.t_max);
    return text.data();
  }

  Vec3 corner() { return mesh_.positions[triangle()[random_.bits() % 3]]; }
  const TriangleIndices& triangle() { return mesh_.triangles[random_.bits() % mesh_.triangles.size()]; }

  /// On a triangle as far as floats allow: a corner, an edge's middle, somewhere inside or just beside it.
  Vec3 target() {
    const TriangleIndices& t = triangle();
    const Vec3d a = to_double(mesh_.positions[t[0]]), b = to_double(mesh_.positions[t[1]]),
                c = to_double(mesh_.positions[t[2]]);
    switch (random_.bits() % 4) {
      case 0:
        return to_float(a);
      case 1:
        return to_float((a + b) * 0.5);
      case 2:
        return to_float((a + b + c) / 3.0);
      default:
        return to_float(a + (b - a) * random_.uniform(-0.1, 1.1) + (c - a) * random_.uniform(-0.1, 1.1));
    }
  }

  /// Inside the mesh's box, on a corner of it, near it or far from it.
  Vec3 place() {
    switch (random_.bits() % 5) {
      case 0:
        return corner();
      case 1:
        return target();
      default:
        return to_float(to_double(box_.center()) + random_.in_cube() * (size_ * random_.magnitude(-1, 2)));
    }
  }

  /// Of zeros, signed ones too, and ones, or hardly anything along one axis.
  Vec3 along_axes() {
    Vec3 direction;
    for (int axis = 0; axis < 3; ++axis) {
      constexpr std::array kValues{0.0F, -0.0F, 1.0F, -1.0F, 0.0F, -0.0F, 1e-38F, -3e-42F, 5.3e-17F};
      direction[axis] = kValues[random_.bits() % kValues.size()];
    }
    return direction;
  }

  /// Now and then an interval that ends at, or right beside, what the ray meets.
  void cut(Ray& ray, float about) {
    const auto beside = [&] {
      const std::uint64_t side = random_.bits() % 3;
      return side == 0 ? about : std::nextafter(about, side == 1 ? 0.0F : kInfinity);
    };
    if (random_.bits() % 4 == 0) ray.t_max = beside();
    if (random_.bits() % 4 == 0) ray.t_min = beside();
    if (random_.bits() % 16 == 0) ray.t_min = -std::abs(beside()) * static_cast<float>(random_.magnitude(-2, 6));
    if (random_.bits() % 64 == 0) ray.t_min = -kInfinity;
  }

  std::vector<Rays> make_rays(int sets) {
    std::vector<Rays> all;
    if (mesh_.triangles.empty()) return {{"of nothing", std::vector<Ray>(20, {{}, {1, 0, 0}}), Vec3{}}};
    for (int i = 0; i < sets; ++i) {
      all.push_back(mixed());
      all.push_back(fan(false));
      all.push_back(fan(true));
      all.push_back(shadows());
    }
    return all;
  }

  Rays mixed() {
    Rays set{"mixed", {}};
    while (set.rays.size() < 150) {
      Ray ray{place(), {}};
      if (random_.bits() % 3 == 0) {
        ray.origin = target();
        ray.direction = along_axes();
        ray.origin = ray.origin - ray.direction * static_cast<float>(size_ * random_.uniform(-1, 2));
      } else {
        ray.direction = target() - ray.origin;
        if (random_.bits() % 4 == 0) ray.direction = ray.direction * static_cast<float>(random_.magnitude(-15, 10));
        cut(ray, 1);
      }
      set.rays.push_back(ray);
    }
    return set;
  }

  /// A camera's, through a raster or at corners, edges and middles all over the mesh: the latter may look anywhere.
  Rays fan(bool aimed) {
    Rays set{aimed ? "fan at targets" : "fan through a raster", {}};
    const Vec3 origin = place();
    set.from = origin;
    const Vec3d forward = to_double(target() - origin), side = random_.direction() * length(forward);
    const double spread = random_.magnitude(-3, 0);
    const Vec3d across = cross(forward, side) / std::max(1e-300, length(forward));
    const int count = random_.bits() % 2 ? 256 : 1 + static_cast<int>(random_.bits() % 1200);
    const auto scale = random_.bits() % 4 ? 1.0F : static_cast<float>(random_.magnitude(-38, 38));  // t may be denormal
    for (int i = 0; i < count; ++i) {
      const double u = (i % 32 - 15.5) / 16, v = (i / 32 % 32 - 15.5) / 16;
      Ray ray{origin, aimed ? target() - origin : to_float(forward + side * (u * spread) + across * (v * spread))};
      ray.direction = ray.direction * scale;
      set.rays.push_back(ray);
    }
    return set;
  }

  Rays shadows() {
    Rays set{"shadows", {}};
    const Vec3 lamp = place();
    set.to = lamp;
    const Vec3 about = target();
    const double spread = size_ * random_.magnitude(-3, 0);
    const int count = random_.bits() % 2 ? 256 : 1 + static_cast<int>(random_.bits() % 1200);
    for (int i = 0; i < count; ++i) {
      const Vec3 origin = i % 2 ? target() : to_float(to_double(about) + random_.in_cube() * spread);
      // Where doubling tells the exact difference from the rounded one, the latter may not lead to the lamp.
      set.rays.push_back({origin, lamp - origin, random_.bits() % 2 ? 0.0F : 1e-4F, random_.bits() % 4 ? 1.0F : 0.5F});
    }
    return set;
  }

  /// Rays that leave what others hit, to anywhere or to a lamp, and some as good as along it. Brute force doesn't know.
  Rays leaving(const Scene& scene, const Accel& brute, bool to_lamp) {
    Rays set{to_lamp ? "leaving to a lamp" : "leaving", {}};
    const Vec3 lamp = place();
    if (to_lamp) set.to = lamp;
    for (int i = 0; i < 256; ++i) {
      Ray first{place(), {}};
      first.direction = target() - first.origin;
      const std::optional<Hit> hit = brute.closest(first);
      if (!hit) continue;
      const SurfacePoint at = world_surface(scene, 0, hit->primitive, first, hit->t);
      const Vec3d normal = at.geometric_normal * (random_.bits() % 2 ? 1 : -1);
      const Vec3 origin = spawn_origin(at, normal);
      Vec3d way = random_.direction() * size_;
      if (random_.bits() % 3 == 0) way = cross(normal, way) + normal * (size_ * random_.magnitude(-12, 0));
      Ray ray{origin, to_lamp ? lamp - origin : to_float(way), 0, to_lamp ? 1 : kInfinity};
      ray.leaves = left_by(ray.direction, to_float(normal), {kObject, hit->primitive});
      set.rays.push_back(ray);
    }
    return set;
  }

  std::string name_;
  TriangleMesh mesh_;
  Random random_;
  Aabb box_;
  double size_;
  int pictures_ = 0, hits_ = 0;
};

TriangleMesh soup(std::uint64_t seed, int count, double extent, double least_exponent = -2) {
  Random random(seed);
  TriangleMesh mesh;
  for (int i = 0; i < count; ++i) {
    const Vec3d at = random.in_cube() * extent;
    const double size = extent * random.magnitude(least_exponent, 0);
    add(mesh, at, at + random.in_cube() * size, at + random.in_cube() * size);
  }
  return mesh;
}

TriangleMesh needles(std::uint64_t seed, int count, double width) {
  Random random(seed);
  TriangleMesh mesh;
  for (int i = 0; i < count; ++i) {
    const Vec3d a = random.in_cube(), b = random.in_cube();
    add(mesh, a, b, b + random.in_cube() * width);
  }
  return mesh;
}

/// Beams that run past the middle, each with others right behind it: what is seen first, far along them, has to be
/// told apart from as near as floats allow up to a tenth of their length.
TriangleMesh layered_beams(std::uint64_t seed, int count) {
  Random random(seed);
  TriangleMesh mesh;
  for (int i = 0; i < count; ++i) {
    const Vec3d way = random.direction(), across = cross(way, random.direction()), normal = cross(way, across);
    const Vec3d middle = random.in_cube() * random.magnitude(-3, 0);
    const double width = random.magnitude(-3, 0), apart = random.magnitude(-7, -1);
    for (int layer = 0; layer < 4; ++layer) {
      const Vec3d at = middle + normal * (apart * layer);
      add(mesh, at - way * random.uniform(-0.1, 1), at + way, at + way * random.uniform(0.5, 1) + across * width);
    }
  }
  return mesh;
}

/// Each triangle several times over, in any order and turned round.
TriangleMesh twins(TriangleMesh mesh, std::uint64_t seed) {
  Random random(seed);
  const auto once = mesh.triangles;
  for (int copy = 0; copy < 3; ++copy)
    for (const auto& [a, b, c] : once)
      mesh.triangles.push_back(random.bits() % 2 ? TriangleIndices{b, c, a} : TriangleIndices{c, b, a});
  for (std::size_t i = mesh.triangles.size(); i > 1; --i)
    std::swap(mesh.triangles[i - 1], mesh.triangles[random.bits() % i]);
  return mesh;
}

/// Triangles of no area: their corners lie on a line, or two fall on one point.
TriangleMesh without_area(std::uint64_t seed) {
  Random random(seed);
  TriangleMesh mesh = soup(seed, 30, 1);
  for (int i = 0; i < 60; ++i) {
    const Vec3d a = to_double(to_float(random.in_cube() * 8)), along{1, static_cast<double>(i % 3), 0.5};
    add(mesh, a, a + along, a + along * 2.0);
  }
  return mesh;
}

/// Of sizes far apart, around one point.
TriangleMesh of_all_sizes(std::uint64_t seed) {
  TriangleMesh mesh;
  for (const double extent : {1e-42, 1e-30, 1e-6, 1.0, 1e6, 1e17}) {
    const TriangleMesh part = soup(seed, 12, extent);
    for (const TriangleIndices& t : part.triangles)
      add(mesh, to_double(part.positions[t[0]]), to_double(part.positions[t[1]]), to_double(part.positions[t[2]]));
  }
  return mesh;
}

struct Reached {
  int pictures = 0, hits = 0;
};

template <typename Make>
Reached expect_agreement(const char* name, int seeds, Make&& make, int sets = 3) {
  Reached reached;
  for (int seed = 0; seed < seeds && !testing::Test::HasFailure(); ++seed) {
    Case one(name, make(static_cast<std::uint64_t>(seed)), static_cast<std::uint64_t>(seed));
    one.expect_agreement(sets);
    reached.pictures += one.pictures();
    reached.hits += one.hits();
  }
  return reached;
}

/// All ways of searching have been gone, and found something.
void expect_tried(const Reached& reached) {
  EXPECT_GT(reached.pictures, 0);
  EXPECT_GT(reached.hits, 100);
}

TEST(WideKernels, AreThoseOfThisMachineTheBestFirst) {
  const auto all = runnable_wide_kernels();
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all.front(), &wide_kernels());
  for (const WideKernels* kernels : all) std::printf("%s\n", kernels->name);
}

TEST(WideKernels, AgreeOnClosedSurfaces_Stress11) {
  expect_tried(expect_agreement("icosphere", effort(4, 60), [](std::uint64_t seed) {
    return scaled(icosphere(3), 1, seed % 2 ? Vec3d{} : Vec3d{3, -7, 11});
  }));
  expect_tried(expect_agreement("globe", effort(3, 40),
                                [](std::uint64_t seed) { return globe(16, 16, 1 + static_cast<double>(seed)); }));
}

TEST(WideKernels, AgreeOnAGridOfItsAxes_Stress1_Stress2_Stress13) {
  expect_tried(expect_agreement("grid", effort(3, 80), [](std::uint64_t seed) {
    TriangleMesh mesh = grid_plane(16);
    for (Vec3& p : mesh.positions)
      if (seed % 3 != 0) p = seed % 3 == 1 ? Vec3{p.y, p.z, p.x} : Vec3{p.z, p.x, p.y};
    return scaled(mesh, 1, seed % 2 ? Vec3d{} : Vec3d{1, 2, 4});
  }));
}

TEST(WideKernels, AgreeOnSoups) {
  expect_tried(expect_agreement("soup", effort(12, 400),
                                [](std::uint64_t seed) { return soup(seed, 300, 10, seed % 2 ? -4 : -1); }));
}

TEST(WideKernels, AgreeOnNeedles_Stress15) {
  expect_tried(expect_agreement("needles", effort(6, 100), [](std::uint64_t seed) {
    return needles(seed, 300, std::pow(10.0, -static_cast<double>(seed % 8)));
  }));
}

TEST(WideKernels, AgreeOnBeamsPastTheCamera) {
  expect_tried(expect_agreement("beams", effort(12, 200), [](std::uint64_t seed) {
    return scaled(layered_beams(seed, 3 + seed * 4 % 40), std::pow(10.0, static_cast<double>(seed % 5) - 1));
  }));
}

TEST(WideKernels, AgreeOnTrianglesWithoutArea_Stress16) {
  expect_tried(expect_agreement("no area", effort(6, 60), without_area));
}

TEST(WideKernels, AgreeOnTwins_Stress23) {
  expect_tried(expect_agreement(
      "twins", effort(2, 60), [](std::uint64_t seed) { return twins(seed % 2 ? icosphere(2) : grid_plane(8), seed); }));
}

TEST(WideKernels, AgreeAtEveryScale_Stress18_Stress20) {
  for (const double scale : {1e-43, 1e-40, 1e-38, 1e-30, 1e-15, 1e-14, 1e-9, 1e9, 1e13, 1e15, 5e17})
    EXPECT_GT(expect_agreement("soup", effort(2, 40), [&](std::uint64_t seed) { return soup(seed, 100, scale); }).hits,
              10)
        << scale;
  for (const double scale : {1e-30, 1e17})
    expect_agreement("icosphere", effort(2, 40), [&](std::uint64_t) { return scaled(icosphere(2), scale); });
}

TEST(WideKernels, AgreeOnAllSizesAtOnce) { expect_agreement("all sizes", effort(4, 200), of_all_sizes); }

TEST(WideKernels, AgreeFarFromTheOrigin_Stress21) {
  for (const double offset : {1e4, 1e6, 1e7, 1e8})
    expect_tried(expect_agreement("far", effort(2, 40), [&](std::uint64_t) {
      return scaled(icosphere(3), 30, Vec3d{-0.6, 1, 0.3} * offset);
    }));
}

TEST(WideKernels, AgreeOnAFewTrianglesAndNone) {
  for (const int count : {0, 1, 2, 3, 5, 8, 9, 17})
    expect_agreement("few", effort(3, 60), [&](std::uint64_t seed) { return soup(seed, count, 1, -0.5); });
}

TEST(WideKernels, AgreeOnLargeMeshes) {
  expect_tried(expect_agreement(
      "large icosphere", 1, [](std::uint64_t) { return icosphere(5); }, effort(2, 40)));
  expect_tried(expect_agreement(
      "large soup", 1, [](std::uint64_t seed) { return soup(seed, 20'000, 10, -3); }, effort(2, 40)));
}

/// A mesh alone, which all rays of a tile search together, with a light that they lead to, and with others.
TEST(WideKernels, MakeOneImage_Stress54) {
  SceneBuilder alone;
  alone.material({.diffuse = {0.6F, 0.5F, 0.4F}, .reflect = {0.3F, 0.3F, 0.3F}});
  alone.light(PointLight{{2, 3, 4}, {30, 30, 30}})
      .light(DirectionalLight{*UnitVec3::normalize(Vec3{1, -2, -1}), {1, 1, 1}});
  alone.add(knot(200, 24));
  Settings settings;
  settings.width = settings.height = static_cast<std::uint32_t>(effort(48, 300));
  settings.samples = 2;
  settings.aovs = {Aov::depth, Aov::normal, Aov::primitive_id, Aov::object_id};
  const PerspectiveCamera camera{{{1, 2, 9}, {0, 0, 0}, {0, 1, 0}}, 0.8F};
  for (const auto& scene : {alone.build(), mixed_scene()}) {
    settings.accel.kind = AccelKind::brute;
    const Image reference = render_image(scene, camera, settings);
    settings.accel.kind = AccelKind::wide;
    const Plan plan = make_plan(*scene, camera, settings);
    for (const WideKernels* kernels : runnable_wide_kernels()) {
      const std::shared_ptr<const Accel> accel = make_wide(scene, settings.accel, *kernels, WideAccel::build_tree);
      EXPECT_TRUE(same_bytes(reference.pixels, render_image(scene, accel, plan, camera, settings).pixels))
          << kernels->name;
    }
  }
}

}  // namespace
}  // namespace tessera
