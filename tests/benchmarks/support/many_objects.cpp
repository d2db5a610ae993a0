#include "tests/benchmarks/support/many_objects.h"

#include <cmath>
#include <utility>

#include "tests/benchmarks/support/bench_camera.h"
#include "tests/benchmarks/support/kernel_meshes.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"

namespace tessera::bench {
namespace {

using Rows = std::array<double, 12>;

/// Where a body of about the unit ball's size stands.
Rows place_in(Crowd crowd, std::uint32_t number, std::uint32_t objects, Random& random) {
  Vec3d at, size;
  if (crowd == Crowd::field) {
    const auto side = static_cast<std::uint32_t>(std::ceil(std::sqrt(objects)));
    const double spacing = 1.0 / side, r = spacing * random.uniform(0.35, 0.6);
    at = {(number % side + 0.5) * spacing, r, (number / side + 0.5) * spacing};
    size = {r, r * random.uniform(0.8, 2), r};
  } else {
    const double r = 0.4 / std::sqrt(objects) * random.uniform(0.7, 1.2);
    at = random.in_cube() * 0.5 + Vec3d{0.5, 0.5, 0.5};
    size = {r, r * random.uniform(0.7, 1), r};
  }
  const Vec3d x = random.direction(), beside = cross(x, random.direction()), y = beside / length(beside);
  const Vec3d z = cross(x, y);
  Rows rows{};
  for (int i = 0; i < 3; ++i) {
    const auto row = static_cast<std::size_t>(i) * 4;
    rows[row] = x[i] * size.x;
    rows[row + 1] = y[i] * size.y;
    rows[row + 2] = z[i] * size.z;
    rows[row + 3] = at[i];
  }
  return rows;
}

/// Of all objects, in an order that says nothing of where they stand.
std::vector<Rows> places(Crowd crowd, std::uint32_t objects) {
  Random random(objects);
  std::vector<Rows> all;
  all.reserve(objects);
  for (std::uint32_t i = 0; i < objects; ++i) all.push_back(place_in(crowd, i, objects, random));
  for (std::uint32_t i = objects; i > 1; --i) std::swap(all[i - 1], all[random.bits() % i]);
  return all;
}

/// The world's corners as they are for a placement of these rows, rounded once.
TriangleMesh standing(const TriangleMesh& body, const Transform& placement) {
  TriangleMesh mesh = body;
  for (Vec3& p : mesh.positions) p = to_float(placement.point_to_world(to_double(p)));
  return mesh;
}

void append(TriangleMesh& all, const TriangleMesh& part) {
  const auto corners = static_cast<std::uint32_t>(all.positions.size());
  all.positions.insert(all.positions.end(), part.positions.begin(), part.positions.end());
  for (const TriangleIndices& t : part.triangles)
    all.triangles.push_back({t[0] + corners, t[1] + corners, t[2] + corners});
}

constexpr Vec3 kLight{-0.7F, 2.2F, 1.2F};

SceneBuilder lit() {
  SceneBuilder builder;
  builder.material(diffuse({0.7F, 0.7F, 0.7F}));
  builder.light(PointLight{kLight, {4, 4, 4}});
  return builder;
}

KernelScene seen(std::string name, std::shared_ptr<const Scene> scene) {
  PerspectiveCamera camera = bench_camera(*scene);
  camera.vertical_fov *= 0.6F;
  return {std::move(name), std::move(scene), camera, kLight};
}

}  // namespace

std::string_view name(Crowd crowd) { return crowd == Crowd::field ? "field" : "swarm"; }

ManyObjects many_objects(Crowd crowd, std::uint32_t objects, std::uint32_t triangles_each) {
  TriangleMesh body = triangles_each == 12 ? smooth_ball(6, 2) : smooth_ball(16, 8);
  body.normals.clear();
  SceneBuilder separate = lit(), placed = lit();
  TriangleMesh all;
  for (const Rows& rows : places(crowd, objects)) {
    const Transform placement = *Transform::from_rows(rows);
    TriangleMesh mesh = standing(body, placement);
    append(all, mesh);
    separate.add(std::move(mesh));
    placed.place(placed.shape(body), 0, placement);
  }
  const std::string label =
      std::string(name(crowd)) + "/" + std::to_string(objects) + "x" + std::to_string(triangles_each);
  return {seen(label, lit().add(std::move(all)).build()), separate.build(), placed.build(),
          static_cast<std::uint32_t>(body.triangles.size())};
}

ManyInstances many_instances(Crowd crowd, std::uint32_t instances) {
  SceneBuilder builder = lit();
  const std::uint32_t shape = builder.shape(organic(5'000));
  std::vector<std::array<float, 12>> all;
  all.reserve(instances);
  for (const Rows& rows : places(crowd, instances)) {
    builder.place(shape, 0, *Transform::from_rows(rows));
    auto& floats = all.emplace_back();
    for (std::size_t i = 0; i < rows.size(); ++i) floats[i] = static_cast<float>(rows[i]);
  }
  return {seen(std::string(name(crowd)) + "/" + std::to_string(instances), builder.build()), std::move(all)};
}

}  // namespace tessera::bench
