// What a structure says of many rays at once is what it says of each, for every kind.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <gtest/gtest.h>

#include "core/accel/accel_table.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr std::size_t kSizes[] = {0, 1, 15, 17, 63, 64, 257, 4097};

/// As many rays as the largest batch has, as a camera at `eye` sends them, or a little worse.
std::vector<Ray> fan_from(Vec3 eye, Vec3 at, bool all_traceable, Random& random) {
  std::vector<Ray> rays;
  const Vec3 forward = at - eye;
  const Vec3 right = cross(forward, {0, 1, 0}), down = cross(forward, right) * (1 / length(forward));
  for (std::size_t i = 0; i < 4097; ++i) {
    const float x = static_cast<float>(i % 64) / 32 - 1, y = static_cast<float>(i / 64) / 32 - 1;
    Ray ray{eye, forward + right * (0.8F * x) + down * (0.8F * y)};
    if (random.bits() % 16 == 0) ray.t_max = static_cast<float>(random.uniform(0.5, 1.5));
    if (random.bits() % 32 == 0) ray.t_min = static_cast<float>(random.uniform(0, 0.5));
    if (!all_traceable && i % 100 == 37) {
      const Vec3 broken[] = {{}, {kNaN, 1, 1}, {1, kInfinity, 0}};
      ray.direction = broken[random.bits() % 3];
    }
    if (!all_traceable && i % 100 == 73) ray.t_min = random.bits() % 2 ? kNaN : kInfinity;
    rays.push_back(ray);
  }
  return rays;
}

std::vector<Ray> any_rays(Random& random, double size) {
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < 4097; ++i) {
    const Vec3 origin = to_float(random.in_cube() * size);
    rays.push_back({origin, to_float(random.in_cube() * size) - origin});
    if (i % 50 == 11) rays.back().direction = {};
    if (i % 50 == 23) rays.back().origin.y = kNaN;
  }
  return rays;
}

/// Those of `rays` that hit nothing on their way to `light`, and others: as an integrator asks for them.
std::vector<Ray> fan_to(Vec3 light, const std::vector<Ray>& rays, const Accel& accel) {
  std::vector<Ray> out;
  for (const Ray& ray : rays) {
    const float t = accel.closest(ray).value_or(Hit{1}).t;
    const Vec3 from = to_float(to_double(ray.origin) + to_double(ray.direction) * (0.999 * t));
    out.push_back({from, to_float(to_double(light) - to_double(from)), 0, 0.999999F});
  }
  return out;
}

class Batches {
 public:
  Batches(const Accel& accel, std::size_t objects) : accel_(accel), objects_(objects) {}

  /// Rays of a fan are taken without their ends.
  void expect_closest(std::vector<Ray> rays, bool is_fan, Candidates among) {
    Directions directions;
    directions.append_those_of(rays);
    if (is_fan)
      for (Ray& ray : rays) ray = {ray.origin, ray.direction};
    std::vector<Hit> alone;
    for (const Ray& ray : rays)
      alone.push_back((among ? accel_.closest_among(ray, *among) : accel_.closest(ray)).value_or(Hit{}));
    for (const std::size_t size : kSizes) {
      const std::span some(rays.data(), size);
      std::vector<Hit> hits(size, Hit{-1, 7, 7});
      ObjectMarks tested(objects_);
      TestCounts counts;
      const TraceLog log = size % 2 ? TraceLog{&tested, &counts} : TraceLog{};
      if (is_fan)
        accel_.closest_fan(RayFan(rays.front().origin, directions).part(0, size), hits, log, among);
      else
        accel_.closest(some, hits, log, among);
      for (std::size_t i = 0; i < size; ++i) ASSERT_EQ(hits[i], alone[i]) << "ray " << i << " of " << size;
      if (!log.tested) continue;
      for (const Hit& hit : hits) {
        if (hit.t == kInfinity) continue;
        ASSERT_FALSE(is_unmarked(tested, hit.object));
      }
    }
    for (const Hit& hit : alone) hits_ += hit.t < kInfinity;
  }

  void expect_occluded(const std::vector<Ray>& rays, std::optional<Vec3> apex) {
    std::vector<std::uint8_t> alone;
    for (const Ray& ray : rays) alone.push_back(accel_.occluded(ray));
    for (const std::size_t size : kSizes) {
      const std::span some(rays.data(), size);
      std::vector<std::uint8_t> hidden(size, 7);
      TestCounts counts;
      const TraceLog log{nullptr, size % 2 ? &counts : nullptr};
      if (apex)
        accel_.occluded_fan(*apex, some, hidden, log);
      else
        accel_.occluded(some, hidden, log);
      for (std::size_t i = 0; i < size; ++i) ASSERT_EQ(hidden[i], alone[i]) << "ray " << i << " of " << size;
    }
    for (const std::uint8_t hidden : alone) hits_ += hidden;
  }

  /// Rays that hit anything, over all calls.
  std::size_t hits() const { return hits_; }

 private:
  /// By what marking it changes.
  static bool is_unmarked(ObjectMarks& marks, std::uint32_t object) {
    const std::uint64_t before = marks.unmarked();
    marks.mark(object);
    return marks.unmarked() != before;
  }

  const Accel& accel_;
  std::size_t objects_;
  std::size_t hits_ = 0;
};

struct NamedScene {
  const char* name;
  std::shared_ptr<const Scene> scene;
  double size;
};

std::vector<NamedScene> scenes() {
  SceneBuilder placed_mesh, flat;
  const auto ball = placed_mesh.shape(icosphere(1));
  placed_mesh.place(ball, 0, placed({0.4, 0.3, 0, 1.2, -0.2, 0.7, 0.1, 1.3, 0, 0, -0.3, 1})).place(ball);
  // Squeezed so far that the directions of some rays become nothing in its own space.
  flat.place(flat.shape(icosphere(1)), 0, placed({1e30, 0, 0, 0, 0, 1e30, 0, 0, 0, 0, 1e30, 0}));
  flat.add(icosphere(1, 0.5F));
  return {{"a mesh", SceneBuilder().add(icosphere(2)).build(), 2},
          {"an instance beside its mesh", placed_mesh.build(), 3},
          {"an instance of any size", flat.build(), 1},
          {"two of the same", SceneBuilder().add(icosphere(1)).add(icosphere(1)).build(), 2},
          {"mixed", mixed_scene(), 4},
          {"few", random_scene(3, 6), 10},
          {"many", random_scene(7, 60), 10},
          {"more than go one by one", random_scene(5, 200), 10},
          {"empty", SceneBuilder().build(), 1}};
}

/// Every third object, and some more.
std::vector<std::uint32_t> some_objects(std::size_t count) {
  std::vector<std::uint32_t> some;
  for (std::uint32_t i = 0; i < count; ++i)
    if (i % 3 == 0 || i % 7 == 2) some.push_back(i);
  return some;
}

class BatchesOf : public testing::TestWithParam<AccelKind> {};

TEST_P(BatchesOf, GiveWhatEachRayIsGivenAlone) {
  for (const auto& [name, scene, size] : scenes()) {
    SCOPED_TRACE(name);
    const auto accel = make_accel(scene, {GetParam()});
    Batches batches(*accel, scene->objects.size());
    Random random(4097);
    const std::vector<std::uint32_t> some = some_objects(scene->objects.size());
    const Vec3 eye = to_float(Vec3d{0.1, 0.3, 1.9} * size), light = to_float(Vec3d{1.3, 1.7, 0.9} * size);
    for (const bool all_traceable : {true, false}) {
      const std::vector<Ray> fan = fan_from(eye, {0, 0, 0}, all_traceable, random);
      ASSERT_EQ(std::ranges::all_of(fan, is_traceable), all_traceable);
      for (const Candidates among : {Candidates(), Candidates(some), Candidates(std::span<const std::uint32_t>())}) {
        batches.expect_closest(fan, true, among);
        batches.expect_closest(fan, false, among);
      }
      batches.expect_occluded(fan_to(light, fan, *accel), light);
      batches.expect_occluded(fan, std::nullopt);
    }
    std::vector<Ray> any = any_rays(random, size);
    for (const Candidates among : {Candidates(), Candidates(some)}) batches.expect_closest(any, false, among);
    batches.expect_occluded(any, std::nullopt);
    std::erase_if(any, [](const Ray& ray) { return !is_traceable(ray); });
    any.insert(any.end(), any.begin(), any.begin() + static_cast<std::ptrdiff_t>(*std::rbegin(kSizes) - any.size()));
    for (const Candidates among : {Candidates(), Candidates(some)}) batches.expect_closest(any, false, among);
    batches.expect_occluded(any, std::nullopt);
    const Vec3 lamp = to_float(Vec3d{0.1, 0.2, -0.1} * size);  // with rays all around
    batches.expect_occluded(fan_to(lamp, any, *accel), lamp);
    if (!scene->objects.empty()) {
      EXPECT_GT(batches.hits(), 1000U);
    }
  }
}

std::vector<AccelKind> kinds() {
  std::vector<AccelKind> all;
  for (const AccelEntry& row : accel_table()) all.push_back(row.kind);
  return all;
}

INSTANTIATE_TEST_SUITE_P(EveryKind, BatchesOf, testing::ValuesIn(kinds()),
                         [](const auto& param) { return std::string(accel_name(param.param)); });

}  // namespace
}  // namespace tessera
