#include "tests/benchmarks/support/kernel_meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include "tests/support/meshes.h"

namespace tessera::bench {
namespace {

/// In [−1, 1), the same for the same point of the lattice.
double lattice_value(std::int64_t x, std::int64_t y, std::int64_t z) {
  std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15ULL ^
                    static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4FULL ^
                    static_cast<std::uint64_t>(z) * 0x165667B19E3779F9ULL;
  h = (h ^ (h >> 29)) * 0xBF58476D1CE4E5B9ULL;
  return static_cast<double>((h ^ (h >> 32)) >> 11) * 0x1p-52 - 1;
}

/// Values on a lattice, smoothly blended: in [−1, 1].
double noise(Vec3d p) {
  std::array<std::int64_t, 3> cell;
  std::array<double, 3> blend;
  for (int i = 0; i < 3; ++i) {
    const double floor = std::floor(p[i]), f = p[i] - floor;
    cell[static_cast<std::size_t>(i)] = static_cast<std::int64_t>(floor);
    blend[static_cast<std::size_t>(i)] = f * f * (3 - 2 * f);
  }
  const auto along_x = [&](int y, int z) {
    return std::lerp(lattice_value(cell[0], cell[1] + y, cell[2] + z),
                     lattice_value(cell[0] + 1, cell[1] + y, cell[2] + z), blend[0]);
  };
  return std::lerp(std::lerp(along_x(0, 0), along_x(1, 0), blend[1]), std::lerp(along_x(0, 1), along_x(1, 1), blend[1]),
                   blend[2]);
}

double bumps(Vec3d p) {
  double sum = 0, amplitude = 0.4;
  for (int octave = 0; octave < 6; ++octave, amplitude *= 0.5) sum += amplitude * noise(p * (1.7 * (1 << octave)));
  return sum;
}

/// An icosahedron's faces cut in n² triangles each, on the unit sphere; points on shared edges are shared.
class Geodesic {
 public:
  explicit Geodesic(std::uint32_t n) : n_(n) {
    for (const TriangleIndices& face : base_.triangles) add_face(face);
  }
  TriangleMesh take() { return std::move(mesh_); }

 private:
  void add_face(const TriangleIndices& face) {
    std::vector<std::vector<std::uint32_t>> rows(n_ + 1);
    for (std::uint32_t i = 0; i <= n_; ++i)
      for (std::uint32_t j = 0; j <= n_ - i; ++j) rows[i].push_back(point(face, {n_ - i - j, i, j}));
    for (std::uint32_t i = 0; i < n_; ++i)
      for (std::uint32_t j = 0; j < n_ - i; ++j) {
        mesh_.triangles.push_back({rows[i][j], rows[i + 1][j], rows[i][j + 1]});
        if (i + j + 2 <= n_) mesh_.triangles.push_back({rows[i + 1][j], rows[i + 1][j + 1], rows[i][j + 1]});
      }
  }

  /// The point with these weights of the face's corners. It is known by corners and weights, whichever face asks.
  std::uint32_t point(const TriangleIndices& face, const std::array<std::uint32_t, 3>& weights) {
    std::array<std::uint64_t, 3> terms{};
    Vec3d sum;
    for (std::size_t i = 0; i < 3; ++i) {
      if (weights[i] > 0) terms[i] = (std::uint64_t{weights[i]} << 4) | face[i];
      sum = sum + to_double(base_.positions[face[i]]) * weights[i];
    }
    std::ranges::sort(terms);
    const auto [at, fresh] = known_.try_emplace((terms[0] << 40) | (terms[1] << 20) | terms[2],
                                                static_cast<std::uint32_t>(mesh_.positions.size()));
    if (fresh) mesh_.positions.push_back(to_float(sum / length(sum)));
    return at->second;
  }

  const TriangleMesh base_ = icosphere(0);
  std::uint32_t n_;
  TriangleMesh mesh_;
  std::unordered_map<std::uint64_t, std::uint32_t> known_;
};

void add_flake(TriangleMesh& mesh, const TriangleMesh& sphere, Vec3d center, double radius, Vec3d axis, int levels) {
  append(mesh, sphere, radius, center);
  if (levels == 0) return;
  const Vec3d helper = std::abs(axis.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  const Vec3d across = cross(axis, helper), u = across / length(across), v = cross(axis, u);
  const auto grow = [&](double longitude, double latitude) {
    const Vec3d way =
        (u * std::cos(longitude) + v * std::sin(longitude)) * std::cos(latitude) + axis * std::sin(latitude);
    add_flake(mesh, sphere, center + way * (radius * 4 / 3), radius / 3, way, levels - 1);
  };
  constexpr double kThird = std::numbers::pi / 3;
  for (int i = 0; i < 6; ++i) grow(kThird * i, 0);
  for (int i = 0; i < 3; ++i) grow(kThird * (2 * i + 0.5), kThird);
}

}  // namespace

TriangleMesh organic(std::uint32_t triangles) {
  TriangleMesh mesh = Geodesic(static_cast<std::uint32_t>(std::lround(std::sqrt(triangles / 20.0)))).take();
  for (Vec3& p : mesh.positions) p = to_float(to_double(p) * (1 + bumps(to_double(p))));
  return mesh;
}

TriangleMesh mesh_flake() {
  TriangleMesh mesh;
  add_flake(mesh, icosphere(3), {}, 1, {0, 1, 0}, 3);
  return mesh;
}

void append(TriangleMesh& mesh, const TriangleMesh& part, double scale, Vec3d center) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vec3& p : part.positions) mesh.positions.push_back(to_float(to_double(p) * scale + center));
  for (const auto& [a, b, c] : part.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
}

}  // namespace tessera::bench
