// STRESS 70 and 71: where the light of smooth low-poly meshes ends.
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/accel_choices.h"
#include "tests/support/image.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

constexpr std::uint32_t kSide = 160;

DirectionalLight sun(Vec3d toward) {
  return {*UnitVec3::normalize(-toward),
          {std::numbers::pi_v<float>, std::numbers::pi_v<float>, std::numbers::pi_v<float>}};
}

Pixels look(std::shared_ptr<const Scene> scene, const Camera& camera, AccelKind kind = AccelKind::automatic) {
  Settings settings;
  settings.width = settings.height = kSide;
  settings.jitter = false;
  settings.accel.kind = kind;
  settings.aovs = {Aov::object_id, Aov::depth};
  return render_image(std::move(scene), camera, settings).pixels;
}

const OrthographicCamera kFromFront{{{0, -5, 0.001F}, {0, 0, 0}, {0, 0, 1}}, 2.2F};

struct Compared {
  double worst = 0;  ///< Against what the sphere shows in the same direction from its middle.
  double error = 0;  ///< Against what it shows in the same pixel: the root of the mean square.
};

/// A ball of triangles against the sphere that it stands for, both seen from the front and lit by a sun.
void compare(const TriangleMesh& mesh, Vec3d to_sun, Compared& out) {
  SceneBuilder b;
  b.material(diffuse({1, 1, 1}));
  const Pixels seen = look(b.add(mesh).light(sun(to_sun)).build(), kFromFront);
  const CameraRays rays(kFromFront, kSide, kSide);
  to_sun = to_sun / length(to_sun);
  int count = 0;
  for (std::uint32_t y = 0; y < kSide; ++y)
    for (std::uint32_t x = 0; x < kSide; ++x) {
      const std::size_t at = std::size_t{y} * kSide + x;
      if (seen.plane<std::uint32_t>(Aov::object_id)[at] == kNoId) continue;
      const Ray ray = rays.ray(x + 0.5, y + 0.5);
      const Vec3d o = to_double(ray.origin), d = to_double(ray.direction);
      const double middle = -dot(o, d) / dot(d, d), inside = 1 - dot(o + middle * d, o + middle * d);
      ASSERT_GT(inside, 0);
      const Vec3d there = o + (middle - std::sqrt(inside / dot(d, d))) * d;
      const Vec3d point = o + double{seen.plane<float>(Aov::depth)[at]} * d, radial = point / length(point);
      const double got = seen.color[at].r, due = std::max(0.0, dot(there, to_sun));
      // A normal that points away from who sees the face is replaced by the face's.
      if (dot(radial, d) < -1e-3) out.worst = std::max(out.worst, std::abs(got - std::max(0.0, dot(radial, to_sun))));
      out.error += (got - due) * (got - due);
      ++count;
    }
  out.error = std::sqrt(out.error / count);
}

const Vec3d kSuns[] = {{1, -1, 0.3}, {1, 0, 0}, {0, 0, 1}, {-0.5, 0.5, 0.6}, {0.2, -1, -0.4}, {-1, 0.9, -0.2}};

/// A ball's interpolated normals are those of the sphere: so is its light, with no face in the way of another.
TEST(Terminator, BallsOfFewTrianglesAreLitAsSpheres_Stress71) {
  for (const Vec3d to_sun : kSuns)
    for (const auto& [around, rings] : {std::pair{12U, 8U}, {8U, 6U}, {24U, 16U}}) {
      Compared found;
      compare(smooth_ball(around, rings), to_sun, found);
      EXPECT_LT(found.worst, 1e-4) << around << "x" << rings;
    }
}

TEST(Terminator, ConvergesToTheSmoothSphere_Stress71) {
  for (const Vec3d to_sun : kSuns) {
    double before = 1;
    for (const std::uint32_t fine : {8U, 16U, 32U, 64U}) {
      Compared found;
      compare(smooth_ball(fine * 3 / 2, fine), to_sun, found);
      EXPECT_LT(found.error, 0.7 * before) << fine;
      before = found.error;
    }
  }
}

/// Each triangle with corners of its own, and the normals of its face.
TriangleMesh faceted(TriangleMesh mesh, bool with_normals) {
  TriangleMesh out;
  for (const TriangleIndices& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(out.positions.size());
    const Vec3d a = to_double(mesh.positions[t[0]]), b = to_double(mesh.positions[t[1]]),
                c = to_double(mesh.positions[t[2]]);
    for (const std::uint32_t vertex : t) out.positions.push_back(mesh.positions[vertex]);
    out.triangles.push_back({first, first + 1, first + 2});
    const Vec3 normal = UnitVec3::normalize(cross(b - a, c - a))->vec();
    if (with_normals) out.normals.insert(out.normals.end(), {normal, normal, normal});
  }
  return out;
}

TEST(Terminator, FlatNormalsChangeNothing_Stress71) {
  const auto image = [](bool with_normals, float side) {
    TriangleMesh mesh = faceted(smooth_ball(12, 8), with_normals);
    for (Vec3& n : mesh.normals) n = n * side;
    SceneBuilder b;
    b.material(diffuse({1, 1, 1}));
    return look(b.add(mesh).light(sun({1, -1, 0.3})).light(PointLight{{-2, -2, 1}, {3, 3, 3}}).build(), kFromFront);
  };
  EXPECT_TRUE(same_bytes(image(false, 1), image(true, 1)));
  EXPECT_TRUE(same_bytes(image(false, 1), image(true, 0.3F)));
  EXPECT_TRUE(same_bytes(image(false, 1), image(true, -1))) << "against the winding";
}

/// Turned inside out.
TriangleMesh inverted(TriangleMesh mesh) {
  for (TriangleIndices& t : mesh.triangles) std::swap(t[1], t[2]);
  for (Vec3& normal : mesh.normals) normal = -normal;
  return mesh;
}

/// Whatever the normals say: in a closed room of thin walls no light comes in, onto smooth bodies that touch the walls
/// least of all.
TEST(Terminator, NothingLeaksIntoAClosedRoom_Stress70) {
  for (const bool inward : {false, true})
    for (const Vec3d to_sun : kSuns) {
      SceneBuilder b;
      b.material(diffuse({1, 1, 1}));
      b.add(inward ? inverted(smooth_box({2, 2, 2})) : smooth_box({2, 2, 2}))
          .light(sun(to_sun))
          .light(PointLight{{2.001F, -1, 1}, {9, 9, 9}});
      TriangleMesh ball = smooth_ball(8, 6);
      for (Vec3& p : ball.positions) p = p + Vec3{1.0001F, 1.0001F, -1.0001F};  // a hair through three walls
      b.add(ball);
      b.add(smooth_box({0.7F, 1.9F, 1.999F})).add(inverted(smooth_box({1.9999F, 0.1F, 0.1F})));
      const auto scene = b.build();
      for (const Vec3 at : {Vec3{0.1F, 0.2F, -0.1F}, Vec3{-1, -1.5F, 1.2F}, Vec3{1.2F, -1.2F, 0.4F}}) {
        const Pixels seen = look(scene, PerspectiveCamera{{{-1.9F, -1.9F, 1.95F}, at, {0, 0, 1}}, 1.8F});
        for (const Rgb& c : seen.color) ASSERT_EQ(c, Rgb{});
      }
    }
}

/// Nothing stands before a ball, so it sees all of the sky: no face hides what the smooth surface sees.
TEST(Terminator, AmbientOcclusionSeesTheSmoothBall_Stress71) {
  Settings settings;
  settings.width = settings.height = 32;
  settings.samples = 16;
  settings.integrator = IntegratorKind::ambient_occlusion;
  settings.aovs = {Aov::object_id};
  SceneBuilder b;
  b.background({1, 1, 1});
  const Pixels seen = render_image(b.add(smooth_ball(8, 6)).build(), kFromFront, settings).pixels;
  double sum = 0;
  for (const Rgb& c : seen.color) sum += c.g;
  EXPECT_GT(std::ranges::count(seen.plane<std::uint32_t>(Aov::object_id), 0U), 400);
  EXPECT_GT(sum / static_cast<double>(seen.color.size()), 0.9999);
}

/// What isn't there at all between the faces and the ball that they stand for hides nothing.
TEST(Terminator, NothingIsHiddenByWhatIsNotThere_Stress71) {
  const auto image = [](float veil, float alpha) {
    SceneBuilder b;
    b.material(diffuse({1, 1, 1}));
    b.add(smooth_ball(8, 6)).light(sun({1, -1, 0.3}));
    Material material;
    material.alpha = alpha;
    b.add(Sphere{{0, 0, 0}, veil}, b.material(material));
    Settings settings;
    settings.width = settings.height = kSide;
    settings.jitter = false;
    settings.integrator = IntegratorKind::direct;
    return render_image(b.build(), kFromFront, settings).pixels;
  };
  EXPECT_TRUE(same_bytes(image(0.98F, 0), image(0.1F, 0)));
  EXPECT_FALSE(same_bytes(image(0.98F, 0.5F), image(0.1F, 0.5F)));
}

TEST(Terminator, EveryStructureShowsTheSame_Stress71) {
  SceneBuilder b;
  b.material(diffuse({1, 1, 1}));
  const auto ball = b.shape(smooth_ball(12, 8));
  b.place(ball).place(ball, 0, placed({0.5, 0, 0, 0.9, 0, -0.3, 0, -0.9, 0.2, 0, 0.4, 0.2}));
  const auto scene = b.light(sun({1, -1, 0.3})).light(PointLight{{-2, -2, 1}, {3, 3, 3}}).build();
  const Pixels reference = look(scene, kFromFront, AccelKind::brute);
  for (const AccelEntry& entry : accel_table()) {
    EXPECT_TRUE(same_bytes(reference, look(scene, kFromFront, entry.kind))) << entry.name;
  }
}

/// Normals that can't be used, and such that can hardly be, do no harm.
TEST(Terminator, StrangeNormalsAreSafe) {
  for (const Vec3 strange : {Vec3{}, Vec3{1e-30F, 0, 0}, Vec3{1e30F, 1e30F, 0}, Vec3{0, 0, -1e-40F}, Vec3{0, 1, 0}}) {
    TriangleMesh mesh = smooth_ball(12, 8);
    for (std::size_t i = 0; i < mesh.normals.size(); i += 3) mesh.normals[i] = strange;
    SceneBuilder b;
    b.material(diffuse({1, 1, 1}));
    for (const Rgb& c : look(b.add(mesh).light(sun({1, -1, 0.3})).build(), kFromFront).color)
      ASSERT_TRUE(c.r >= 0 && c.r <= 1.0001F);
  }
}

}  // namespace
}  // namespace tessera
