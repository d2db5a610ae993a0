#include "server/jobs/job_runner.h"

#include <atomic>
#include <condition_variable>
#include <future>
#include <mutex>
#include <new>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/accel/wide/wide_accel.h"
#include "core/accel/wide/wide_build.h"
#include "core/scene/frame_scene.h"
#include "tests/support/meshes.h"

namespace tessera::server {
namespace {

using proto::JobState;
constexpr std::chrono::seconds kLong{60};
constexpr std::chrono::milliseconds kMoment{100};

/// Everything that a job needs, with a way to make structures of the test's choosing.
class JobRunnerTest : public testing::Test {
 protected:
  JobRunnerTest() {
    Scene scene;
    scene.materials.emplace_back();
    scene.shapes.emplace_back(Sphere{{0, 0, 0}, 1});
    scene.objects.push_back({0, 0, std::nullopt});
    scene.background = {1, 2, 3};
    scene_ = std::make_shared<const Scene>(with_bounds(std::move(scene)));
  }

  std::string start(const Camera& camera, AccelKind accel = AccelKind::bvh, const Settings& settings = {}) {
    JobOrder order{"", "sha256:0", 0, settings};
    order.settings.width = order.settings.height = 32;
    order.settings.tile_size = 8;
    order.settings.accel.kind = accel;
    const auto admitted = jobs_.add(order);
    runner_.start(*admitted, order, scene_, camera);
    return admitted->id;
  }

  /// What becomes of a job; every unit of work has been done when this returns.
  JobView ended(const std::string& id) {
    while (!proto::has_ended((*jobs_.find(id)).state)) std::this_thread::yield();
    return *jobs_.find(id);
  }

  std::shared_ptr<const Scene> scene_;
  StructureCache::Make make_ = make_accel;
  StructureCache structures_{
      1 << 20, [this](auto scene, const AccelOptions& options) { return make_(std::move(scene), options); }};
  JobTable jobs_{{100, 100, 1 << 20}};
  Scheduler scheduler_{2};
  JobRunner runner_{scheduler_, structures_, jobs_};
};

TEST_F(JobRunnerTest, RendersAJob) {
  const JobView job = ended(start(frame_scene(*scene_, 32, 32)));
  EXPECT_EQ(job.state, JobState::completed);
  EXPECT_EQ((*jobs_.film(job.id))->versions(), std::vector<std::uint32_t>(16, 1)) << "every tile was stored once";
  EXPECT_EQ(job.progress->tiles(), 16U);
  EXPECT_EQ(job.progress->samples(), 32U * 32U);
  EXPECT_EQ(job.progress->rays().camera, job.plan->camera_rays);
  ASSERT_TRUE(job.structure);
  EXPECT_EQ(job.structure->options.kind, AccelKind::bvh);
}

TEST_F(JobRunnerTest, RendersPassAfterPass) {
  Settings settings;
  settings.samples = 40;
  const JobView job = ended(start(frame_scene(*scene_, 32, 32), AccelKind::bvh, settings));
  EXPECT_EQ(job.state, JobState::completed);
  EXPECT_EQ(job.progress->samples(), 32U * 32 * 40);
  EXPECT_EQ(job.progress->rays().camera, job.plan->camera_rays);
  EXPECT_EQ(job.progress->tiles(), 16U);
  const proto::JobStatus status = status_of(job, JobTimes::Clock::now());
  EXPECT_EQ(status.passes, 4U) << "1, 4, 16 and 40 samples";
  EXPECT_EQ(status.ended_by, "samples");
  EXPECT_EQ(status.progress, 1);
  EXPECT_EQ(status.samples_per_pixel.least, 40U);
  EXPECT_EQ(status.samples_per_pixel.most, 40U);
  EXPECT_FALSE(status.achieved) << "it wasn't asked to be measured";
  for (const std::uint32_t version : (*jobs_.film(job.id))->versions()) EXPECT_EQ(version, 4U);
}

TEST_F(JobRunnerTest, EndsWithTheErrorThatWasAskedFor) {
  Settings settings;
  settings.samples = 1 << 20;
  settings.error = 0.05F;
  const JobView job = ended(start(frame_scene(*scene_, 32, 32), AccelKind::bvh, settings));
  const proto::JobStatus status = status_of(job, JobTimes::Clock::now());
  EXPECT_EQ(status.ended_by, "error");
  ASSERT_TRUE(status.achieved);
  EXPECT_LE(status.achieved->interval.high, 0.05);
  EXPECT_LE(status.achieved->interval.low, status.achieved->error);
  EXPECT_LT(status.samples_done, status.samples_total);
  EXPECT_EQ(status.samples_total, 32U * 32 << 20) << "the most that there may be";
  EXPECT_EQ(status.progress, 1);
  EXPECT_EQ(status.tiles_done, 16U);
}

TEST_F(JobRunnerTest, EndsAtOnceWhereSamplesCannotDiffer) {
  Settings settings;
  settings.samples = 300;
  settings.error = 0.05F;
  const auto samples = [&](const Camera& camera) {
    const proto::JobStatus status = status_of(ended(start(camera, AccelKind::bvh, settings)), JobTimes::Clock::now());
    EXPECT_EQ(status.achieved.has_value(), status.ended_by == "error");
    return status.samples_per_pixel.most;
  };
  Scene dark = *scene_;
  dark.background = {};
  const auto unlit = std::make_shared<const Scene>(dark);
  dark.lights = {PointLight{{0, 0, 0}, {9, 9, 9}}};  // Shut in: nothing is seen, and no two samples differ.
  scene_ = std::make_shared<const Scene>(std::move(dark));
  const Camera away = PerspectiveCamera{View{{0, 0, 9}, {0, 0, 99}}};
  PerspectiveCamera with_lens{View{{0, 0, 9}, {0, 0, 0}}};
  with_lens.lens = {0.1F, 9};
  for (const IntegratorKind integrator : {IntegratorKind::whitted, IntegratorKind::path}) {
    settings.integrator = integrator;
    settings.jitter = true;
    EXPECT_EQ(samples(frame_scene(*scene_, 32, 32)), 300U) << "a light may have been missed";
    EXPECT_EQ(samples(away), 1U);
    settings.jitter = false;
    EXPECT_EQ(samples(frame_scene(*scene_, 32, 32)), integrator == IntegratorKind::whitted ? 1U : 300U);
    EXPECT_EQ(samples(with_lens), 300U);
    const auto lit = std::exchange(scene_, unlit);
    EXPECT_EQ(samples(with_lens), 1U) << "there is no light that could be missed";
    settings.transparent = true;
    EXPECT_EQ(samples(with_lens), 300U) << "edges are";
    settings.transparent = false;
    scene_ = lit;
  }
  scene_ = unlit;
  settings.integrator = IntegratorKind::ambient_occlusion;
  EXPECT_EQ(samples(with_lens), 300U);
}

TEST_F(JobRunnerTest, EndsInTime) {
  Settings settings;
  settings.samples = 4294967295;
  settings.seconds = 0.05;
  const JobView job = ended(start(frame_scene(*scene_, 32, 32), AccelKind::bvh, settings));
  const proto::JobStatus status = status_of(job, JobTimes::Clock::now());
  EXPECT_EQ(job.state, JobState::completed);
  EXPECT_EQ(status.ended_by, "seconds");
  EXPECT_GE(status.samples_per_pixel.least, 1U);
  for (const std::uint32_t version : (*jobs_.film(job.id))->versions()) EXPECT_GE(version, 1U);
}

/// Each pass takes a second of a clock of our own, however long it is.
TEST_F(JobRunnerTest, PassesFillTheTimeThatThereIs) {
  std::atomic<int> readings{0};
  JobRunner runner(scheduler_, structures_, jobs_,
                   [&] { return std::chrono::steady_clock::time_point(std::chrono::seconds(readings++)); });
  JobOrder order{"", "sha256:0", 0, {}};
  order.settings.width = order.settings.height = 32;
  order.settings.samples = 1 << 20;
  order.settings.seconds = 10;
  const auto admitted = jobs_.add(order);
  runner.start(*admitted, order, scene_, frame_scene(*scene_, 32, 32));
  const proto::JobStatus status = status_of(ended(admitted->id), JobTimes::Clock::now());
  EXPECT_EQ(status.ended_by, "seconds");
  EXPECT_EQ(status.passes, 10U) << "a pass a second";
  EXPECT_EQ(readings, 11) << "when it begins, and after each";
  EXPECT_GT(status.samples_per_pixel.least, 10U);
  EXPECT_EQ(status.samples_done, 32U * 32 * status.samples_per_pixel.least);
}

TEST_F(JobRunnerTest, MemoryOfPassesIsThereAgainWhenAJobHasEnded) {
  Settings settings;
  settings.width = settings.height = 32;
  settings.samples = 2;
  ASSERT_GT(passes_bytes(settings), 0U);
  settings.tile_size = 8;
  const std::uint64_t image = image_bytes(settings);
  JobTable table({100, 100, 2 * image + passes_bytes(settings)});
  JobRunner runner(scheduler_, structures_, table);
  for (int i = 0; i < 2; ++i) {
    const JobOrder order{"", "sha256:0", 0, settings};
    const auto admitted = table.add(order);
    ASSERT_TRUE(admitted);
    EXPECT_FALSE(table.add(order)) << "two at once are too many";
    runner.start(*admitted, order, scene_, frame_scene(*scene_, 32, 32));
    while (!proto::has_ended((*table.find(admitted->id)).state)) std::this_thread::yield();
  }
  for (const JobView& job : table.list("", 9, std::nullopt)) EXPECT_EQ(job.image, proto::ImageState::complete);
}

TEST_F(JobRunnerTest, AStructureIsRenderedWithTheSceneThatItWasBuiltOver) {
  const Camera camera = frame_scene(*scene_, 32, 32);
  ended(start(camera));
  const auto first = scene_;
  auto same_hash = std::make_shared<Scene>(*scene_);
  same_hash->background = {9, 9, 9};  // To tell which is used: equal hashes mean equal scenes otherwise.
  scene_ = same_hash;
  const JobView job = ended(start(camera));
  ASSERT_TRUE(job.structure && job.structure->shared);
  EXPECT_EQ((*jobs_.film(job.id))->pixels().color.front(), first->background);
}

TEST_F(JobRunnerTest, CountsTheObjectsThatNoRayWasTestedWith) {
  Scene scene = *scene_;
  scene.shapes.emplace_back(Sphere{{0, 0, 99}, 1});  // Behind the camera.
  scene.objects.push_back({1, 0, std::nullopt});
  const Camera camera = PerspectiveCamera{View{{0, 0, 9}, {0, 0, 0}}};
  scene_ = std::make_shared<const Scene>(with_bounds(std::move(scene)));
  const JobView job = ended(start(camera));
  EXPECT_EQ(job.state, JobState::completed) << job.error;
  EXPECT_EQ(job.tested->unmarked(), 1U);
}

TEST_F(JobRunnerTest, AFailedBuildFailsItsJobAlone) {
  make_ = [](std::shared_ptr<const Scene>, const AccelOptions&) -> std::unique_ptr<const Accel> {
    throw std::runtime_error("no luck");
  };
  const JobView failed = ended(start(frame_scene(*scene_, 32, 32)));
  EXPECT_EQ(failed.state, JobState::failed);
  EXPECT_EQ(failed.error, "no luck");
  make_ = make_accel;
  EXPECT_EQ(ended(start(frame_scene(*scene_, 32, 32))).state, JobState::completed);
}

TEST_F(JobRunnerTest, AFailedTileFailsItsJobAlone) {
  struct Broken : Accel {
    std::optional<Hit> closest(const Ray&, TraceLog) const override { throw std::runtime_error("a tile broke"); }
    bool occluded(const Ray&, TraceLog) const override { return false; }
    std::optional<Hit> closest_among(const Ray& ray, std::span<const std::uint32_t>, TraceLog log) const override {
      return closest(ray, log);
    }
    std::optional<Hit> coincident(const Ray&, const Hit&, TraceLog) const override { return std::nullopt; }
    AccelStats stats() const override { return {}; }
  };
  make_ = [](std::shared_ptr<const Scene>, const AccelOptions&) { return std::make_unique<const Broken>(); };
  const JobView failed = ended(start(frame_scene(*scene_, 32, 32), AccelKind::brute));
  EXPECT_EQ(failed.state, JobState::failed);
  EXPECT_EQ(failed.error, "a tile broke");
  make_ = make_accel;
  EXPECT_EQ(ended(start(frame_scene(*scene_, 32, 32), AccelKind::bvh)).state, JobState::completed);
}

TEST_F(JobRunnerTest, MemoryThatRunsOutFailsTheJobAlone) {
  make_ = [](std::shared_ptr<const Scene>, const AccelOptions&) -> std::unique_ptr<const Accel> {
    throw std::bad_alloc();
  };
  const JobView failed = ended(start(frame_scene(*scene_, 32, 32)));
  EXPECT_EQ(failed.state, JobState::failed);
  EXPECT_EQ(failed.error, "out of memory");
  make_ = make_accel;
  EXPECT_EQ(ended(start(frame_scene(*scene_, 32, 32))).state, JobState::completed);
}

TEST_F(JobRunnerTest, TilesWithoutAnEndLeaveTurnsToOthers) {
  const Camera camera = frame_scene(*scene_, 32, 32);
  std::vector<std::string> endless;
  for (int i = 0; i < 2; ++i) {
    JobOrder order{"", "sha256:0", 0, {}};
    order.settings.width = order.settings.height = 1;
    order.settings.samples = 4294967295;
    const auto admitted = jobs_.add(order);
    runner_.start(*admitted, order, scene_, camera);
    endless.push_back(admitted->id);
  }
  for (const std::string& id : endless)
    while ((*jobs_.find(id)).progress->samples() == 0) std::this_thread::yield();
  EXPECT_EQ(ended(start(camera)).state, JobState::completed);
  for (const std::string& id : endless) {
    const JobView job = *jobs_.find(id);
    EXPECT_EQ(job.state, JobState::rendering);
    EXPECT_EQ(job.progress->tiles(), 0U);
    ASSERT_TRUE(jobs_.cancel(id));
  }
  EXPECT_EQ(ended(start(camera)).state, JobState::completed);
}

/// Between two of its questions a thread gives parts away, so each waits a moment for another one: that may begin late.
TEST_F(JobRunnerTest, ThreadsThatHaveNothingToDoTakePartsOfATile) {
  struct Crowd {
    std::mutex mutex;
    std::condition_variable changed;
    std::set<std::thread::id> threads;
  } crowd;
  struct AskedByTwo : Accel {
    AskedByTwo(std::unique_ptr<const Accel> of, Crowd& who) : inner(std::move(of)), crowd(who) {}
    void closest_fan(const RayFan& fan, std::span<Hit> hits, TraceLog log, Candidates among) const override {
      std::unique_lock lock(crowd.mutex);
      crowd.threads.insert(std::this_thread::get_id());
      crowd.changed.notify_all();
      crowd.changed.wait_for(lock, kMoment, [&] { return crowd.threads.size() > 1; });
      lock.unlock();
      inner->closest_fan(fan, hits, log, among);
    }
    std::optional<Hit> closest(const Ray& ray, TraceLog log) const override { return inner->closest(ray, log); }
    bool occluded(const Ray& ray, TraceLog log) const override { return inner->occluded(ray, log); }
    std::optional<Hit> closest_among(const Ray& ray, std::span<const std::uint32_t> objects,
                                     TraceLog log) const override {
      return inner->closest_among(ray, objects, log);
    }
    std::optional<Hit> coincident(const Ray& ray, const Hit& hit, TraceLog log) const override {
      return inner->coincident(ray, hit, log);
    }
    AccelStats stats() const override { return inner->stats(); }
    std::unique_ptr<const Accel> inner;
    Crowd& crowd;
  };
  make_ = [&](std::shared_ptr<const Scene> scene, const AccelOptions& options) {
    return std::make_unique<const AskedByTwo>(make_accel(std::move(scene), options), crowd);
  };
  JobOrder order{"", "sha256:0", 0, {}};
  order.settings.width = order.settings.height = order.settings.tile_size = 64;
  order.settings.samples = 16;
  order.settings.screen_bounds = ScreenBounds::off;
  const Camera camera = frame_scene(*scene_, 64, 64);
  const auto image = [&](JobRunner& runner) {
    const auto admitted = jobs_.add(order);
    runner.start(*admitted, order, scene_, camera);
    const JobView job = ended(admitted->id);
    EXPECT_EQ(job.state, JobState::completed) << job.error;
    EXPECT_EQ(job.plan->tiles, 1U);
    EXPECT_EQ(job.progress->tiles(), 1U);
    EXPECT_EQ(job.progress->samples(), 64U * 64 * 16);
    return (*jobs_.film(job.id))->pixels().color;
  };
  const auto by_two = image(runner_);
  EXPECT_EQ(crowd.threads.size(), 2U);
  Scheduler one(1);
  JobRunner alone(one, structures_, jobs_);
  EXPECT_EQ(image(alone), by_two);
}

TEST_F(JobRunnerTest, AJobThatIsCanceledWhileItWaitsNeverBegins) {
  JobOrder order{"", "sha256:0", 0, {}};
  order.settings.width = order.settings.height = 32;
  const auto admitted = jobs_.add(order);
  ASSERT_TRUE(jobs_.cancel(admitted->id));
  runner_.start(*admitted, order, scene_, frame_scene(*scene_, 32, 32));
  EXPECT_EQ(ended(start(frame_scene(*scene_, 32, 32))).state, JobState::completed);
  EXPECT_EQ((*jobs_.find(admitted->id)).state, JobState::canceled);
  EXPECT_FALSE((*jobs_.find(admitted->id)).times.preparing);
}

TEST_F(JobRunnerTest, ACanceledJobsBuildEnds) {
  Scene scene = *scene_;
  scene.shapes.emplace_back(icosphere(4, 1, {3, 0, 0}));
  scene.objects.push_back({1, 0, std::nullopt});
  scene_ = std::make_shared<const Scene>(with_bounds(std::move(scene)));
  const Camera camera = frame_scene(*scene_, 32, 32);
  for (const AccelKind kind : {AccelKind::bvh, AccelKind::wide}) {
    std::promise<void> begun, canceled;
    std::atomic<int> builds = 0, built = 0;
    const auto build = [&](const auto& make) {
      if (++builds == 1) {
        begun.set_value();
        canceled.get_future().wait();
      }
      auto made = make();
      ++built;
      return made;
    };
    make_ = [&](std::shared_ptr<const Scene> over, const AccelOptions& options) -> std::unique_ptr<const Accel> {
      if (kind == AccelKind::bvh) return build([&] { return make_accel(std::move(over), options); });
      return std::make_unique<const WideAccel>(std::move(over), options, wide_kernels(), [&](const TriangleMesh& mesh) {
        return build([&] { return MadeTree{build_wide(mesh)}; });
      });
    };
    const std::string id = start(camera, kind);
    begun.get_future().wait();
    ASSERT_TRUE(jobs_.cancel(id));
    canceled.set_value();
    EXPECT_EQ(ended(start(camera, kind)).state, JobState::completed);
    while (scheduler_.usage().busy > 0) std::this_thread::yield();
    EXPECT_EQ(builds, 2);
    EXPECT_EQ(built, 1) << "the canceled job's was left";
    EXPECT_EQ((*jobs_.find(id)).state, JobState::canceled);
  }
}

TEST_F(JobRunnerTest, BuildsTheMeshesThatRaysComeTo) {
  Scene scene = *scene_;
  for (const float z : {0.0F, 99.0F}) {  // The second one is behind the camera.
    scene.shapes.emplace_back(icosphere(2, 1, {3, 0, z}));
    scene.objects.push_back({static_cast<std::uint32_t>(scene.objects.size()), 0, std::nullopt});
  }
  scene_ = std::make_shared<const Scene>(with_bounds(std::move(scene)));
  std::atomic<bool> fails = true;
  make_ = [&](std::shared_ptr<const Scene> over, const AccelOptions& options) {
    return std::make_unique<const WideAccel>(std::move(over), options, wide_kernels(), [&](const TriangleMesh& mesh) {
      if (fails) throw std::runtime_error("no mesh today");
      return MadeTree{build_wide(mesh)};
    });
  };
  const Camera camera = PerspectiveCamera{View{{0, 0, 9}, {0, 0, 0}}};
  const JobView failed = ended(start(camera, AccelKind::wide));
  EXPECT_EQ(failed.state, JobState::failed);
  EXPECT_EQ(failed.error, "no mesh today");
  fails = false;
  const JobView job = ended(start(camera, AccelKind::wide));
  ASSERT_EQ(job.state, JobState::completed) << job.error;
  EXPECT_TRUE(job.structure->shared) << "only the mesh was missing";
  EXPECT_EQ(job.structure->stats.meshes, 2U);
  EXPECT_EQ(job.structure->stats.meshes_ready, 1U);
  EXPECT_GT(job.structure->stats.mesh_seconds, 0);
  EXPECT_GT(job.structure->build_seconds, job.structure->stats.mesh_seconds);
}

TEST_F(JobRunnerTest, BuildsNothingWhereNothingProjects) {
  make_ = [](std::shared_ptr<const Scene>, const AccelOptions&) -> std::unique_ptr<const Accel> {
    throw std::logic_error("built for nothing");
  };
  const JobView job = ended(start(PerspectiveCamera{View{{0, 0, 9}, {0, 0, 99}}}));
  EXPECT_EQ(job.state, JobState::completed) << job.error;
  EXPECT_FALSE(job.structure);
  EXPECT_EQ((*jobs_.film(job.id))->pixels().color.front(), (Rgb{1, 2, 3}));
  EXPECT_EQ(job.progress->rays().traced(), 0U);
}

TEST_F(JobRunnerTest, ACanceledJobGoesNoFurther) {
  std::promise<void> begun, go;
  make_ = [&](std::shared_ptr<const Scene> scene, const AccelOptions& options) {
    begun.set_value();
    go.get_future().wait();
    return make_accel(std::move(scene), options);
  };
  const std::string id = start(frame_scene(*scene_, 32, 32));
  begun.get_future().wait();
  ASSERT_TRUE(jobs_.cancel(id));
  go.set_value();
  EXPECT_TRUE(scheduler_.shut_down(kLong));
  EXPECT_EQ((*jobs_.find(id)).state, JobState::canceled);
  EXPECT_FALSE(jobs_.film(id));
}

}  // namespace
}  // namespace tessera::server
