#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "core/geometry/triangle.h"
#include "core/integrator/spawn.h"
#include "core/light/light_table.h"
#include "core/sampling/warp.h"
#include "core/scene/scene.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace tessera::light_checks {

inline constexpr double kPi = std::numbers::pi;
inline constexpr Vec3 kUp{0, 0, 1};

/// A material that sends out light.
inline Material glowing(Rgb emission = {1, 1, 1}, bool both_sides = false) {
  Material material;
  material.emission = emission;
  material.emits_both_sides = both_sides;
  return material;
}

inline Vec2 random_square(Random& random) {
  return {static_cast<float>(random.bits() >> 40) * 0x1p-24F, static_cast<float>(random.bits() >> 40) * 0x1p-24F};
}
inline float random_pick(Random& random) { return static_cast<float>(random.bits() >> 40) * 0x1p-24F; }

/// What a ray of unit direction meets first, found by asking everything.
struct Met {
  PrimitiveId primitive;
  double distance;
  Vec3d normal;
};
inline std::optional<Met> meet(const Scene& scene, Vec3 origin, Vec3 direction) {
  Ray ray{origin, direction};
  std::optional<PrimitiveId> nearest;
  for (std::uint32_t o = 0; o < scene.objects.size(); ++o) {
    const Object& object = scene.objects[o];
    const Shape& shape = scene.shapes[object.shape];
    const auto* mesh = std::get_if<TriangleMesh>(&shape);
    for (std::uint32_t p = 0; p < primitive_count(shape); ++p) {
      const Ray local = object.placement ? object.placement->to_local(ray) : ray;
      std::optional<float> t;
      if (mesh) {
        const auto& i = mesh->triangles[p];
        t = intersect_triangle(TriangleRay(local), mesh->positions[i[0]], mesh->positions[i[1]], mesh->positions[i[2]]);
      } else {
        t = intersect_single(shape, local);
      }
      if (!t) continue;
      ray.t_max = *t;
      nearest = PrimitiveId{o, p};
    }
  }
  if (!nearest) return std::nullopt;
  const float t = ray.t_max;
  ray.t_max = kInfinity;
  return Met{*nearest, t, world_surface(scene, nearest->object, nearest->primitive, ray, t).geometric_normal};
}

/// The density that a table claims for a direction: of what a ray meets there, or of what lies behind all.
inline double claimed_pdf(const LightTable& table, const Scene& scene, Vec3 from, Vec3 normal, Vec3 direction) {
  const auto met = meet(scene, from, direction);
  if (!met) return table.escaped(table.viewpoint(to_double(from), normal), direction).pdf;
  if (emitted(scene, met->primitive.object, direction, met->normal).is_black()) return 0;
  return table.pdf_hit(table.viewpoint(to_double(from), normal), direction, met->primitive, met->distance, met->normal);
}

/// The radiance that a direction really brings.
inline Rgb seen(const LightTable& table, const Scene& scene, Vec3 from, Vec3 direction) {
  const auto met = meet(scene, from, direction);
  return met ? emitted(scene, met->primitive.object, direction, met->normal)
             : table.escaped(table.viewpoint(to_double(from), {}), direction).radiance;
}

/// The directions of a cone, cut into cells of equal solid angle.
class DirectionCells {
 public:
  static constexpr int kRings = 16, kSectors = 24;
  static constexpr std::size_t kCount = kRings * kSectors;

  DirectionCells(Vec3d axis, double one_minus_cos)
      : basis_(basis_around(to_float(axis / length(axis)))), one_minus_cos_(one_minus_cos) {}

  double solid_angle() const { return 2 * kPi * one_minus_cos_ / kCount; }

  /// `kCount` for a direction outside the cone.
  std::size_t cell_of(Vec3 direction) const {
    const Vec3d local = to_double(basis_.to_local(direction));
    const double sine = std::hypot(local.x, local.y);
    const double height = local.z > 0 ? sine * sine / (1 + local.z) : 1 - local.z;  // 1 − cos
    const int ring = static_cast<int>(height / one_minus_cos_ * kRings * (1 - 1e-9));
    const int sector = static_cast<int>((std::atan2(local.y, local.x) / (2 * kPi) + 0.5) * kSectors) % kSectors;
    return ring < kRings ? static_cast<std::size_t>(ring * kSectors + sector) : kCount;
  }

  /// A point of a cell, `x` and `y` in (0, 1).
  Vec3 direction(std::size_t cell, double x, double y) const {
    const double height = (static_cast<double>(cell / kSectors) + y) / kRings * one_minus_cos_;
    const double around = 2 * kPi * ((static_cast<double>(cell % kSectors) + x) / kSectors - 0.5);
    const double sine = std::sqrt(height * (2 - height));
    return *UnitVec3::normalize(to_double(basis_.x) * (sine * std::cos(around)) +
                                to_double(basis_.y) * (sine * std::sin(around)) + to_double(basis_.z) * (1 - height));
  }

  /// What a density comes to in a cell; and whether it is 0 in a part of it.
  struct Part {
    double probability = 0;
    bool at_edge = false;
  };
  template <typename Density>
  Part integrate(const Density& density, std::size_t cell, int points = 12) const {
    double sum = 0;
    int zeros = 0;
    for (int y = 0; y < points; ++y)
      for (int x = 0; x < points; ++x) {
        const double value = density(direction(cell, (x + 0.5) / points, (y + 0.5) / points));
        sum += value;
        zeros += value == 0;
      }
    if (zeros > 0 && zeros < points * points && points < 64) return integrate(density, cell, 96);
    return {sum / (points * points) * solid_angle(), zeros > 0};
  }

 private:
  Basis basis_;
  double one_minus_cos_;
};

/// That the table samples directions as it claims: by a χ² test of 10⁶ of them over the cells, and by comparing what it
/// tells of one and the same direction. Cells that hold an edge of the light count as one. With `all_there` every
/// sample finds light.
inline void expect_sampled_as_claimed(const std::shared_ptr<const Scene>& of, Vec3 from, Vec3 normal,
                                      const DirectionCells& cells, bool all_there = true) {
  constexpr int kSamples = 1'000'000, kCompared = 20'000;
  const Scene& scene = *of;
  const LightTable table(of);
  std::vector<double> observed(DirectionCells::kCount + 2), expected(DirectionCells::kCount + 2);
  double& at_edges = observed[DirectionCells::kCount];
  double& failed = observed[DirectionCells::kCount + 1];
  Random random(7);
  int outside = 0, rounded_off = 0, different = 0;
  for (int i = 0; i < kSamples; ++i) {
    const float pick = random_pick(random);
    const auto sample = table.sample(table.viewpoint(to_double(from), normal), pick, random_square(random));
    if (!sample) {
      ++failed;
      continue;
    }
    const std::size_t cell = cells.cell_of(sample->to_light);
    if (cell < DirectionCells::kCount)
      ++observed[cell];
    else
      ++outside;
    if (i >= kCompared) continue;
    const double claimed = claimed_pdf(table, scene, from, normal, sample->to_light);
    // Directions are rounded, and at an edge normals turn fast: a rounding moves the hit by the cosine's inverse, and
    // so changes the cosine, which the density goes by, in proportion to that once more.
    const auto met = meet(scene, from, sample->to_light);
    const double cosine = met ? dot(to_double(sample->to_light), met->normal) : 1;
    const double same = (1e-4 + 16 * 0x1p-23 / (cosine * cosine)) / sample->pdf + 0.05 * cells.solid_angle();
    if (claimed == 0)
      ++rounded_off;
    else if (std::abs(1 / claimed - 1 / sample->pdf) > same)
      ++different;
  }
  EXPECT_EQ(outside, 0);
  EXPECT_LE(rounded_off, kCompared / 1000);
  EXPECT_EQ(different, 0);

  double total = 0;
  for (std::size_t cell = 0; cell < DirectionCells::kCount; ++cell) {
    const auto part = cells.integrate([&](Vec3 way) { return claimed_pdf(table, scene, from, normal, way); }, cell);
    total += part.probability;
    expected[part.at_edge ? DirectionCells::kCount : cell] += part.probability * kSamples;
    if (!part.at_edge) continue;
    at_edges += observed[cell];
    observed[cell] = 0;
  }
  if (all_there) {
    EXPECT_LE(failed, 5) << "but for the rounding of edges";
  }
  EXPECT_NEAR(total, 1 - failed / kSamples, 2e-3);
  expected.back() = failed;
  EXPECT_GT(chi_square_test(observed, expected).p, 1e-4);
}

/// The irradiance on a plane with that normal, sampled.
inline Moments irradiance(const LightTable& table, Vec3 from, Vec3 normal, int samples, std::uint64_t seed = 1) {
  Moments moments;
  Random random(seed);
  for (int i = 0; i < samples; ++i) {
    const auto sample =
        table.sample(table.viewpoint(to_double(from), normal), random_pick(random), random_square(random));
    const double cosine = sample ? dot(to_double(sample->to_light), to_double(normal)) : 0;
    moments.add(cosine > 0 ? sample->radiance.g * cosine / sample->pdf : 0);
  }
  return moments;
}

/// By a t-test, but for what rounding to float does to what hardly varies.
inline void expect_mean(const Moments& found, double right) {
  const bool is_rounded = std::abs(found.mean() / right - 1) <= 1e-6;
  EXPECT_TRUE(is_rounded || t_test(found, right) > 1e-3) << found.mean() << " instead of " << right;
}

}  // namespace tessera::light_checks
